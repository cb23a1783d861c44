"""``divespot fuse``: depth frames in, one scan out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from divespot.cli.depth import DepthFrames, frame_options
from divespot.cli.outputs import check_outputs, force_option, points_option
from divespot.cli.screen import file_name, progress_line, tell
from divespot.output import POINTS, POSES

if TYPE_CHECKING:
    from divespot.io import Scan


@click.command()
@click.argument("frames", metavar="FRAMES...", type=click.Path(), nargs=-1, required=True)
@frame_options
@points_option(required=True)
@click.option(
    "--poses",
    type=click.Path(),
    metavar="PATH",
    help="write the camera's pose in each frame, in TUM's format",
)
@click.option(
    "--voxel-m",
    type=float,
    metavar="METRES",
    help="edge of the voxels in which pixels are averaged  [default: two pixels wide]",
)
@click.option("--threads", type=click.IntRange(min=0), default=0, help="threads to use; 0: all")
@force_option
@click.pass_context
def fuse(ctx: click.Context, /, **given: Any) -> None:  # noqa: ANN401 - as many types as options
    """Fuse depth frames into one scan: FRAMES is a folder, a list of images, an NPY or NPZ file.

    FRAMES may also be a recording of ROS or RealSense (.bag, .mcap, .db3) or of Azure Kinect
    (.mkv), which needs no --intrinsics if it holds them.

    The camera's poses are found from the frames themselves; the floor becomes z = 0.
    """
    from divespot.frames import write_poses  # noqa: PLC0415 - slow to import
    from divespot.io import write  # noqa: PLC0415 - as above
    from divespot.io.write import require_writable  # noqa: PLC0415 - as above

    depth = DepthFrames.of(ctx)
    if depth is None or not depth.takes(given["frames"][0]):
        raise click.UsageError("--intrinsics is needed: the camera that took the frames", ctx)
    require_writable(given["output"])
    outputs = {"--output": (given["output"], POINTS), "--poses": (given["poses"], POSES)}
    check_outputs(outputs, (*given["frames"], *depth.read()), force=given["force"])
    frames = given["frames"]
    source = frames[0] if len(frames) == 1 else frames
    with progress_line(f"fusing {file_name(frames[0])}") as on_frame:
        scan = depth.fused(source, given["threads"], on_frame, voxel_m=given["voxel_m"])
    for warning in scan.warnings:
        tell(f"divespot: {warning}")
    write(given["output"], scan.points)
    if given["poses"] is not None and scan.registration is not None:
        write_poses(given["poses"], scan.registration.poses, scan.registration.times_s)
    click.echo(_told(scan, given["output"]))


def _told(scan: Scan, output: str) -> str:
    found = scan.registration
    line = f"{file_name(output)}: {len(scan.points):,} points"
    if found is None:
        return line
    return (
        f"{line} of {found.frames} frames, heights ± {2000 * found.u_height_m:.2f} mm, ranges "
        f"{1000 * found.offset_m:+.1f} mm ± {2000 * found.u_offset_m:.1f} mm"
    )
