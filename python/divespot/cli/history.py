"""``divespot history``: list earlier measurements."""

from __future__ import annotations

import json
from io import StringIO
from typing import TYPE_CHECKING

import click

from divespot.cli.outputs import (
    STDOUT,
    check_outputs,
    ends_in,
    force_option,
    json_option,
    write_json,
)
from divespot.cli.results import PICTURES
from divespot.output import PICTURE, TABLE, whole, write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.results.history import Entry


@click.command()
@click.argument("history", metavar="PATH.db", type=click.Path())
@click.option("--site", help="only measurements of this site")
@click.option(
    "--csv", "csv_file", type=click.Path(), metavar="PATH", help="write one row per pile as CSV"
)
@json_option("print all reports as JSON Lines, with their times", metavar="-")
@click.option(
    "--picture",
    type=click.Path(),
    callback=ends_in(PICTURES),
    metavar="PATH.png|.svg|.pdf",
    help="draw the total over time, with its u95",
)
@force_option
def history(  # noqa: PLR0913, PLR0917 - one argument an option
    history: str,
    site: str | None,
    csv_file: str | None,
    json_file: str | None,
    picture: str | None,
    force: bool,  # noqa: FBT001 - click's call
) -> None:
    """List the measurements that `divespot measure --history PATH.db` kept.

    Each row shows the change since the previous measurement of the same site.
    """
    from divespot.results.history import entries  # noqa: PLC0415 - slow to import

    check_outputs(
        {"--csv": (csv_file, TABLE), "--picture": (picture, PICTURE)}, (history,), force=force
    )
    found = entries(history, site)
    if csv_file is not None:
        write_text(csv_file, _csv(found))
    if json_file is not None:
        write_json(json_file, _lines(found))
    if json_file != STDOUT:
        show(found)
    if picture is not None:
        _draw(found, picture)


def show(found: Sequence[Entry]) -> None:
    """Print a row for each measurement."""
    from divespot.cli.table import Table, show_table  # noqa: PLC0415 - slow to import
    from divespot.numbers import volume_unit, with_uncertainty  # noqa: PLC0415
    from divespot.results.telling import counted  # noqa: PLC0415

    unit, per_m3 = volume_unit(max((abs(one.volume_m3) for one in found), default=1.0))
    names = ("time", f"volume {unit}", f"change {unit}", "mass kg", "piles", "site")
    table = Table(names, text=True)
    last: dict[str, Entry] = {}
    for one in found:
        volume = with_uncertainty(per_m3 * one.volume_m3, per_m3 * one.u95_m3)
        mass = "" if one.mass_kg is None else with_uncertainty(one.mass_kg, one.u95_mass_kg or 0.0)
        change = _change(last.get(one.site), one, per_m3)
        table.add_row(one.time, volume, change, mass, str(one.piles), one.site)
        last[one.site] = one
    click.echo(f"{counted(len(found), 'measurement')}\n")
    show_table(table)


def _change(before: Entry | None, one: Entry, per_m3: float) -> str:
    from divespot.numbers import with_uncertainty  # noqa: PLC0415 - slow to import

    if before is None:
        return ""
    u95 = (before.u95_m3**2 + one.u95_m3**2) ** 0.5
    return with_uncertainty(per_m3 * (one.volume_m3 - before.volume_m3), per_m3 * u95)


def _csv(found: Sequence[Entry]) -> str:
    from divespot.report import Report  # noqa: PLC0415 - slow to import
    from divespot.results.csv_rows import rows_of, text_of  # noqa: PLC0415 - as above
    from divespot.results.parsed import parsed  # noqa: PLC0415 - as above

    text = StringIO(text_of((), header=True))
    text.seek(0, 2)
    for one in found:
        text.write(text_of(rows_of(parsed(one.report, Report), one.time), header=False))
    return text.getvalue()


def _lines(found: Sequence[Entry]) -> str:
    lines = ({"time": one.time, "site": one.site, **json.loads(one.report)} for one in found)
    return "\n".join(json.dumps(line, allow_nan=False) for line in lines)


def _draw(found: Sequence[Entry], path: str) -> None:
    from divespot.plot import drawn_bytes, figure_class  # noqa: PLC0415 - needs the plot extra
    from divespot.results.drawings import draw_history  # noqa: PLC0415 - as above
    from divespot.results.show_units import VOLUMES, Shown  # noqa: PLC0415 - as above

    figure = figure_class()(figsize=(9.0, 4.0), layout="constrained")
    axes = figure.subplots()
    sites = dict.fromkeys(one.site for one in found)
    for site in sites:
        own = [one for one in found if one.site == site]
        draw_history(axes, own, Shown("volume", *VOLUMES["m3"]), label=site or None)
    if any(sites):
        axes.legend(frameon=False, fontsize=8)
    with whole(path) as stream:
        stream.write(drawn_bytes(figure, path))
