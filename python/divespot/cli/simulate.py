"""``divespot simulate``: scans whose truth is known."""

from __future__ import annotations

import json
from typing import IO, TYPE_CHECKING, Any

import click

from divespot.cli.options import simulation_options
from divespot.cli.screen import progress_line

if TYPE_CHECKING:
    from divespot.simulate import SimulatedScan

TRUTH_SCHEMA = "divespot.truth/1"


def list_names(ctx: click.Context, _param: click.Parameter, value: bool) -> None:  # noqa: FBT001 - click's call
    """Print the names of all scenes, with what each is, and exit."""
    if not value:
        return
    from divespot.simulate import NAMES, scene_named  # noqa: PLC0415 - slow to import
    from divespot.simulate.families import FAMILIES  # noqa: PLC0415 - as above

    for name in NAMES:
        volumes = " + ".join(f"{pile.volume_m3:g}" for pile in scene_named(name).piles)
        told = f"{volumes} m3" if volumes else "no pile"
        click.echo(f"{name:<18} {'drawn by the seed' if name in FAMILIES else told}")
    ctx.exit()


@click.command()
@click.argument("name")
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=list_names,
    help="print the names of all scenes with the volumes of their piles, and exit",
)
@click.option(
    "--output",
    "-o",
    required=True,
    type=click.Path(),
    metavar="PATH",
    help="file for the points: .ply, .npy, .xyz, .las or .laz",
)
@click.option(
    "--truth",
    type=click.File("w", encoding="utf-8", lazy=True),
    metavar="PATH|-",
    help="write the truth as JSON, - for stdout and nothing else there",
)
@simulation_options
def simulate(name: str, output: str, truth: IO[str] | None, seed: int, density: float) -> None:
    """Simulate a depth camera's scan of the scene NAME, whose volumes are known exactly."""
    from divespot.io import write  # noqa: PLC0415 - slow to import

    taken = simulated(name, seed, density)
    write(output, taken.points)
    if truth is not None:
        click.echo(json.dumps(truth_of(taken, density), indent=1), file=truth)
    if truth is None or truth.name != "-":
        volumes = " + ".join(f"{volume:.5g}" for volume in taken.volumes_m3) or "0"
        count = f"{len(taken.points):,}"
        click.echo(f"{click.format_filename(output)}: {count} points, truth {volumes} m3")


def simulated(name: str, seed: int, density: float = 1.0) -> SimulatedScan:
    """Simulate with a progress line."""
    from divespot.simulate import scan  # noqa: PLC0415 - slow to import

    with progress_line(f"simulating {name}"):
        return scan(name, seed=seed, density=density)


def truth_of(taken: SimulatedScan, density: float) -> dict[str, Any]:
    """Return what is known of a simulated scan, for JSON.

    `pose` is the rigid motion in metres, row by row, from the scene's frame (floor at z = 0) into
    the scan's.
    """
    return {
        "schema": TRUTH_SCHEMA,
        "name": taken.scene.name,
        "seed": taken.seed,
        "density": density,
        "points": len(taken.points),
        "volume_m3": taken.volume_m3,
        "volumes_m3": list(taken.volumes_m3),
        "up": taken.up.tolist(),
        "pose": taken.pose.tolist(),
    }
