"""``divespot simulate``: scans whose true volume is known."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from divespot.cli.options import simulation_options
from divespot.cli.outputs import STDOUT, check_outputs, force_option, points_option, write_json
from divespot.cli.screen import file_name, progress_line
from divespot.output import POINTS, REPORT

if TYPE_CHECKING:
    from divespot.simulate import SimulatedScan
    from divespot.simulate.sequence import Path

TRUTH_SCHEMA = "divespot.truth/1"


def list_names(ctx: click.Context, _param: click.Parameter, value: bool) -> None:  # noqa: FBT001 - click's call
    """Print the names of all scenes with their volumes, and exit."""
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
@points_option(required=False)
@click.option(
    "--frames",
    type=click.Path(),
    metavar="DIR",
    help="folder for simulated depth frames instead: 16-bit PNG in mm (NPZ without the extra "
    "frames), intrinsics.json, true poses.txt",
)
@click.option(
    "--path",
    type=click.Choice(["rail", "hand", "fixed"]),
    default="rail",
    show_default=True,
    help="how the camera of --frames moves",
)
@click.option("--count", type=click.IntRange(min=1), help="frames  [default: the rail's, 45, 30]")
@click.option(
    "--truth",
    type=click.Path(allow_dash=True),
    metavar="PATH|-",
    help="write the truth as JSON; -: to stdout, and nothing else there",
)
@simulation_options
@force_option
def simulate(  # noqa: PLR0913, PLR0917 - one argument an option
    name: str,
    output: str | None,
    frames: str | None,
    path: Path,
    count: int | None,
    truth: str | None,
    seed: int,
    density: float,
    force: bool,  # noqa: FBT001 - click's call
) -> None:
    """Simulate a depth camera's scan of the scene NAME, whose volumes are known exactly."""
    from divespot.io import write  # noqa: PLC0415 - slow to import

    if (output is None) == (frames is None):
        raise click.UsageError("one of --output and --frames is needed")
    outputs = {"--output": (output, POINTS), "--truth": (truth, REPORT)}
    check_outputs(outputs, (), force=force)
    if frames is not None:
        _frames(frames, name, path, count, (seed, density), truth=truth, force=force)
        return
    taken = simulated(name, seed, density)
    write(str(output), taken.points)
    if truth is not None:
        write_json(truth, json.dumps(truth_of(taken, density), indent=1))
    if truth != STDOUT:
        volumes = " + ".join(f"{volume:.5g}" for volume in taken.volumes_m3) or "0"
        points = f"{len(taken.points):,}"
        click.echo(f"{file_name(str(output))}: {points} points, truth {volumes} m3")


def _frames(  # noqa: PLR0913 - what the options say
    folder: str,
    name: str,
    path: Path,
    count: int | None,
    drawn: tuple[int, float],
    *,
    truth: str | None,
    force: bool,
) -> None:
    """Write depth frames, their intrinsics and true poses, and the truth."""
    from divespot.frames.sequence import require_free, write_frames  # noqa: PLC0415 - slow to import
    from divespot.simulate import frames  # noqa: PLC0415 - as above

    require_free(folder, force=force)
    seed, density = drawn
    with progress_line(f"simulating {name}"):
        taken = frames(name, path=path, count=count, seed=seed, density=density)
    written = write_frames(folder, taken.depth, taken.matrix, taken.poses)
    if truth is not None:
        known = {"schema": TRUTH_SCHEMA, "name": taken.scene.name, "seed": seed}
        known |= {"density": density, "frames": len(taken.depth), "path": path}
        known |= {"volume_m3": taken.volume_m3, "volumes_m3": list(taken.volumes_m3)}
        write_json(truth, json.dumps(known, indent=1))
    if truth != STDOUT:
        volumes = " + ".join(f"{volume:.5g}" for volume in taken.volumes_m3) or "0"
        told = f"{len(taken.depth)} frames ({written})"
        click.echo(f"{file_name(folder)}: {told}, truth {volumes} m3")


def simulated(name: str, seed: int, density: float = 1.0) -> SimulatedScan:
    """Simulate a scan, with a progress line."""
    from divespot.simulate import scan  # noqa: PLC0415 - slow to import

    with progress_line(f"simulating {name}"):
        return scan(name, seed=seed, density=density)


def truth_of(taken: SimulatedScan, density: float) -> dict[str, Any]:
    """Return the truth of a simulated scan, for JSON.

    `pose` is the rigid motion in metres, row by row, from the scene's frame (floor at z = 0) to
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
