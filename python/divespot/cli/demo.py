"""``divespot demo``: simulate a scan of known volume and measure it."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click

from divespot.cli.measure import run
from divespot.cli.options import simulation_options
from divespot.cli.outputs import check_outputs
from divespot.cli.screen import file_name
from divespot.cli.simulate import simulated
from divespot.cli.telling import show, show_warnings
from divespot.errors import unwritable
from divespot.output import PICTURE, POINTS

if TYPE_CHECKING:
    from divespot.cli.table import Table
    from divespot.report import Report


@click.command()
@click.option(
    "--out",
    type=click.Path(),
    default="divespot-demo",
    show_default=True,
    metavar="DIR",
    help="folder for the scan and the picture",
)
@click.option(
    "--shape",
    default="three-piles",
    show_default=True,
    metavar="NAME",
    help="scene to simulate; `divespot simulate --list` names them",
)
@simulation_options
def demo(out: str, shape: str, seed: int, density: float) -> None:
    """Simulate a scan of known volume, measure it, and compare.

    Prints the true and the measured volume and the time of each stage, and draws the plan with the
    volume on each pile if matplotlib is installed.
    """
    from divespot.cli.table import show_table  # noqa: PLC0415 - as above
    from divespot.cli.tables import times_table  # noqa: PLC0415 - slow to import
    from divespot.io import write  # noqa: PLC0415 - slow to import
    from divespot.settings import Settings  # noqa: PLC0415

    folder = _folder(out)
    scan, picture = folder / f"{shape}.ply", folder / f"{shape}.png"
    check_outputs(
        {"scan": (str(scan), POINTS), "picture": (str(picture), PICTURE)}, (), force=False
    )
    taken = simulated(shape, seed, density)
    write(scan, taken.points)
    report = run(scan, Settings(unit="m"))
    drawn = _draw(report, picture, taken.volume_m3)
    show_warnings(report)
    show(report)
    click.echo()
    show_table(_comparison(report, taken.volumes_m3))
    click.echo()
    show_table(times_table(report.timings_s, report.source.points))
    click.echo(f"\n{drawn}")


def _draw(report: Report, picture: Path, truth_m3: float) -> str:
    """Draw the picture; return its path, or the extra that it needs, as a sentence."""
    from divespot.plot import save_picture  # noqa: PLC0415 - slow to import

    if find_spec("matplotlib") is None:
        return "no picture: it needs matplotlib (pip install divespot[plot])"
    save_picture(report, picture, truth_m3=truth_m3)
    return f"picture: {file_name(picture)}"


def _folder(out: str) -> Path:
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise unwritable(file_name(folder), error) from None
    return folder


def _comparison(report: Report, volumes_m3: tuple[float, ...]) -> Table:
    from divespot.cli.table import Table  # noqa: PLC0415 - slow to import
    from divespot.numbers import rounded, volume_unit, with_uncertainty  # noqa: PLC0415

    truth_m3, total = sum(volumes_m3), report.total
    unit, per_m3 = volume_unit(max(truth_m3, total.volume_m3))
    measured = with_uncertainty(per_m3 * total.volume_m3, per_m3 * total.u95_m3)
    error = f"{total.volume_m3 / truth_m3 - 1:+.2%}" if truth_m3 else "-"
    table = Table(("", "truth", "measured", "error"))
    table.add_row("piles", str(len(volumes_m3)), str(len(report.piles)), "")
    table.add_row(f"volume {unit}", rounded(per_m3 * truth_m3, 5), measured, error)
    return table
