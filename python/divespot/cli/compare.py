"""``divespot compare``: what was gained and lost between two scans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from divespot.cli.change_files import FILES, change_options
from divespot.cli.options import Grouped, chosen_settings, setting_options
from divespot.cli.outputs import STDOUT, check_outputs, force_option, json_option, write_json
from divespot.cli.profile import profile_option
from divespot.cli.screen import file_name, loudness_options, progress_line, tell
from divespot.errors import printable
from divespot.output import REPORT
from divespot.results.show_units import VOLUMES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from divespot.cli.table import Table
    from divespot.results.change_document import Unit
    from divespot.results.comparison import Comparison


@click.command(cls=Grouped)
@click.argument("before", type=click.Path())
@click.argument("after", type=click.Path())
@profile_option
@setting_options
@json_option("write the comparison as JSON; -: to stdout, and nothing else there")
@click.option("--site", default="", help="name of the site, for --report")
@click.option("--show-unit", type=click.Choice(list(VOLUMES)), help="unit of the tables' volumes")
@click.option(
    "--align/--no-align",
    default=True,
    help="raise and shift the earlier scan so that unchanged ground and piles coincide in both; "
    "off: use it as it is  [default: on]",
)
@change_options
@loudness_options
@force_option
@click.pass_context
def compare(  # noqa: PLR0913, PLR0917 - one argument an option
    ctx: click.Context,
    /,
    before: str,
    after: str,
    json_file: str | None,
    site: str,
    show_unit: str | None,
    align: bool,  # noqa: FBT001 - click's call
    quiet: bool,  # noqa: FBT001 - as above
    force: bool,  # noqa: FBT001 - as above
    **_others: Any,  # noqa: ANN401 - as many types as settings; read from the context
) -> None:
    """Measure what was gained and lost between the scans BEFORE and AFTER.

    Both must be in one frame. Piles that overlap are matched; places are areas where the surfaces
    differ by more than the detection limit.
    """
    from divespot.comparing import compare as run  # noqa: PLC0415 - slow to import

    settings = chosen_settings(ctx)
    outline = settings.outline if isinstance(settings.outline, str) else None
    files = {item: ctx.params[item.name] for item in FILES if ctx.params[item.name] is not None}
    outputs = {item.flag: (path, item.own) for item, path in files.items()}
    read = before, after, outline, ctx.params["profile"]
    check_outputs({"--json": (json_file, REPORT), **outputs}, read, force=force)
    with progress_line(f"comparing {file_name(after)}") as on_stage:
        found = run(before, after, settings, do_align=align, on_stage=on_stage)
    if json_file is not None:
        write_json(json_file, found.to_json())
    if not quiet:
        for warning in found.warnings:
            tell(f"divespot: warning: {printable(warning)}")
    if not quiet and json_file != STDOUT:
        show(found, show_unit)
    if files:
        _save(found, files.values(), site, show_unit)


def _save(found: Comparison, paths: Iterable[str], site: str, unit_name: str | None) -> None:
    from divespot.results.change_document import Unit  # noqa: PLC0415 - slow to import
    from divespot.results.change_report import save_change  # noqa: PLC0415 - needs extras

    for path in paths:  # outputs, checked before anything was measured
        save_change(found, path, site=site or None, unit=Unit.of(found, unit_name), force=True)


def show(found: Comparison, unit_name: str | None) -> None:
    """Print a comparison for people."""
    from divespot.cli.table import show_table  # noqa: PLC0415 - slow to import
    from divespot.results.change_document import Unit  # noqa: PLC0415 - as above

    unit = Unit.of(found, unit_name)
    if found.piles:
        show_table(_piles(found, unit))
        click.echo()
    if found.places:
        show_table(_places(found, unit))
        click.echo()
    for name in ("gain", "loss", "net"):
        change = getattr(found, name)
        told = "none" if change.is_none else f"{unit.told(change)} {unit.sign}"
        click.echo(f"{name}: {told}")
    click.echo(f"smallest height change that is detected: {found.alignment.detection_m:.2g} m")


def _piles(found: Comparison, unit: Unit) -> Table:
    from divespot.cli.table import Table  # noqa: PLC0415 - slow to import
    from divespot.numbers import rounded  # noqa: PLC0415 - as above
    from divespot.results.change_document import numbers  # noqa: PLC0415 - as above

    sign, per_m3 = unit.sign, unit.per_m3
    table = Table(
        ("pile", f"before {sign}", f"after {sign}", f"change {sign}", "was", ""), text=True
    )
    for one in found.piles:
        table.add_row(
            numbers(one.after),
            rounded(per_m3 * one.volume_before_m3, 4),
            rounded(per_m3 * one.volume_after_m3, 4),
            unit.told(one.change),
            numbers(one.before),
            one.state,
        )
    return table


def _places(found: Comparison, unit: Unit) -> Table:
    from divespot.cli.table import Table  # noqa: PLC0415 - slow to import
    from divespot.numbers import rounded  # noqa: PLC0415 - as above
    from divespot.results.change_document import numbers  # noqa: PLC0415 - as above

    volumes = (f"{name} {unit.sign}" for name in ("gain", "loss", "net", "limit"))
    table = Table(("place", *volumes, "area m²", "on pile", "was"), text=True)
    for one in found.places:
        table.add_row(
            str(one.id),
            unit.rounded(one.gain_m3),
            unit.rounded(one.loss_m3),
            unit.told(one.net),
            rounded(unit.per_m3 * one.detection_m3, 2),
            rounded(one.area_m2),
            numbers(one.piles),
            numbers(one.piles_before),
        )
    return table
