"""``divespot materials``: the table of bulk densities."""

from __future__ import annotations

import click

from divespot.materials import MATERIALS, SOURCE


@click.command()
def materials() -> None:
    """List the materials that `measure --material` knows.

    A density range is for one material poured and measured in different ways; every value in it is
    taken as equally likely, which gives the standard uncertainty (GUM 4.3.7).
    """
    from divespot.cli.table import Table, show_table  # noqa: PLC0415 - slow to import

    table = Table(("material", "density kg/m³", "range", "u", "angle of repose °"))
    for name, material in MATERIALS.items():
        low, high = material.density_range_kg_m3
        angles = material.repose_deg
        repose = "-" if angles is None else "-".join(f"{angle:g}" for angle in sorted({*angles}))
        u = f"{material.density_u_kg_m3:.0f}"
        table.add_row(name, f"{material.density_kg_m3:.0f}", f"{low:.0f}-{high:.0f}", u, repose)
    show_table(table)
    click.echo(f"sources: {SOURCE}")
