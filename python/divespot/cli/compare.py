"""``divespot compare``: what was gained and lost between two scans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from divespot.cli.options import Grouped, chosen_settings, setting_options
from divespot.cli.outputs import STDOUT, check_outputs, force_option, json_option, write_json
from divespot.cli.profile import profile_option
from divespot.cli.screen import file_name, loudness_options, progress_line, tell
from divespot.errors import printable
from divespot.output import REPORT
from divespot.results.show_units import VOLUMES

if TYPE_CHECKING:
    from divespot.cli.table import Table
    from divespot.results.comparison import Change, Comparison


@click.command(cls=Grouped)
@click.argument("before", type=click.Path())
@click.argument("after", type=click.Path())
@profile_option
@setting_options
@json_option("write the comparison as JSON, - for stdout and nothing else there")
@click.option("--show-unit", type=click.Choice(list(VOLUMES)), help="unit of the tables' volumes")
@click.option(
    "--align/--no-align",
    default=True,
    help="raise the earlier scan so that ground that did not change lies on itself; off: heights "
    "are taken as they are  [default: on]",
)
@loudness_options
@force_option
@click.pass_context
def compare(  # noqa: PLR0913, PLR0917 - one argument an option
    ctx: click.Context,
    /,
    before: str,
    after: str,
    json_file: str | None,
    show_unit: str | None,
    align: bool,  # noqa: FBT001 - click's call
    quiet: bool,  # noqa: FBT001 - as above
    force: bool,  # noqa: FBT001 - as above
    **_others: Any,  # noqa: ANN401 - as many types as settings; read from the context
) -> None:
    """Tell what was gained and lost between the scans BEFORE and AFTER.

    Both are in one frame: x and y are taken as they are. Piles of the two are matched where they
    lie on each other; places are where the surfaces differ by more than can be told apart.
    """
    from divespot.comparing import compare as run  # noqa: PLC0415 - slow to import

    settings = chosen_settings(ctx)
    outline = settings.outline if isinstance(settings.outline, str) else None
    read = before, after, outline, ctx.params["profile"]
    check_outputs({"--json": (json_file, REPORT)}, read, force=force)
    with progress_line(f"comparing {file_name(after)}") as on_stage:
        found = run(before, after, settings, do_align=align, on_stage=on_stage)
    if json_file is not None:
        write_json(json_file, found.to_json())
    if quiet:
        return
    for warning in found.warnings:
        tell(f"divespot: warning: {printable(warning)}")
    if json_file != STDOUT:
        show(found, show_unit)


def show(found: Comparison, unit_name: str | None) -> None:
    """Print a comparison for people."""
    from divespot.cli.table import show_table  # noqa: PLC0415 - slow to import
    from divespot.numbers import volume_unit, with_uncertainty  # noqa: PLC0415 - as above

    volumes = [abs(place.net.volume_m3) for place in found.places]
    volumes += [max(one.volume_before_m3, one.volume_after_m3) for one in found.piles]
    unit, per_m3 = VOLUMES[unit_name] if unit_name else volume_unit(max(volumes, default=1.0))

    def told(change: Change) -> str:
        return with_uncertainty(per_m3 * change.volume_m3, per_m3 * change.u95_m3)

    if found.piles:
        show_table(_piles(found, unit, per_m3, told))
        click.echo()
    if found.places:
        show_table(_places(found, unit, per_m3, told))
        click.echo()
    for name in ("gain", "loss", "net"):
        change = getattr(found, name)
        click.echo(f"{name}: {'none' if change.is_none else f'{told(change)} {unit}'}")
    click.echo(f"least height that is told from none: {found.alignment.detection_m:.2g} m")


def _piles(found: Comparison, unit: str, per_m3: float, told: Any) -> Table:  # noqa: ANN401
    from divespot.cli.table import Table  # noqa: PLC0415 - slow to import
    from divespot.numbers import rounded  # noqa: PLC0415 - as above

    names = ("pile", f"before {unit}", f"after {unit}", f"change {unit}", "was", "")
    table = Table(names, text=True)
    for one in found.piles:
        table.add_row(
            _numbers(one.after),
            rounded(per_m3 * one.volume_before_m3, 4),
            rounded(per_m3 * one.volume_after_m3, 4),
            told(one.change),
            _numbers(one.before),
            one.state,
        )
    return table


def _places(found: Comparison, unit: str, per_m3: float, told: Any) -> Table:  # noqa: ANN401
    from divespot.cli.table import Table  # noqa: PLC0415 - slow to import
    from divespot.numbers import rounded  # noqa: PLC0415 - as above

    names = ("place", f"gain {unit}", f"loss {unit}", f"net {unit}", "area m²", "on pile")
    table = Table(names, text=True)
    for one in found.places:
        table.add_row(
            str(one.id),
            rounded(per_m3 * one.gain_m3),
            rounded(per_m3 * one.loss_m3),
            told(one.net),
            rounded(one.area_m2),
            _numbers(one.piles or one.piles_before),
        )
    return table


def _numbers(ids: tuple[int, ...]) -> str:
    return ", ".join(map(str, ids)) or "-"
