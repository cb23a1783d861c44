"""Options of depth frames, and fusing the frames into a scan."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from divespot.io import Scan

F = TypeVar("F", bound="Callable[..., Any]")

#: The options that say how depth frames are read.
NAMES = (*("intrinsics", "depth_scale", "depth_kind", "depth_topic", "known_poses", "exact_poses"),)
_FILE = click.Path()


def frame_options(command: F) -> F:
    """Add the options of depth frames; with ``--intrinsics``, SCAN is frames."""
    options = (
        click.option(
            "--intrinsics",
            type=_FILE,
            metavar="K.json",
            help="read SCAN as depth frames of a camera with these intrinsics (Open3D, RealSense, "
            "ROS or Azure Kinect; JSON or YAML): a folder of 16-bit PNG or TIFF, or NPY or NPZ; a "
            "recording (.bag, .mcap, .db3, .mkv) may hold its own",
        ),
        click.option(
            "--depth-scale",
            type=float,
            metavar="METRES",
            help="metres per unit of depth  [default: 0.001 for integers, else 1]",
        ),
        click.option(
            "--depth-kind",
            type=click.Choice(["planar", "radial"]),
            default="planar",
            show_default=True,
            help="depth along the optical axis, or along the ray",
        ),
        click.option(
            "--depth-topic",
            metavar="TOPIC",
            help="topic of a ROS recording to read, if several hold depth",
        ),
        click.option(
            "--known-poses",
            type=_FILE,
            metavar="PATH",
            help="approximate camera poses, one per frame: TUM, KITTI or a 4 x 4 matrix per line",
        ),
        click.option("--exact-poses", is_flag=True, help="use the known poses unchanged"),
    )
    for option in reversed(options):
        command = option(command)
    return command


@dataclass(frozen=True)
class DepthFrames:
    """How depth frames are read."""

    intrinsics: str | None
    depth_scale: float | None
    depth_kind: Any
    depth_topic: str | None
    known_poses: str | None
    exact_poses: bool

    @classmethod
    def of(cls, ctx: click.Context) -> DepthFrames | None:
        """Return the options' values; None if no SCAN is frames.

        Raises
        ------
        click.UsageError
            An option of frames was given, but no frames.

        """
        given = {name: ctx.params[name] for name in NAMES}
        if given["intrinsics"] is None and not any(map(_holds_its_own, _paths(ctx))):
            for name in ("depth_scale", "depth_topic", "known_poses", "exact_poses"):
                if given[name]:
                    option = "--" + name.replace("_", "-")
                    sentence = (
                        f"{option} was given: --intrinsics, or a recording, is needed with it"
                    )
                    raise click.UsageError(sentence, ctx)
            return None
        if given["exact_poses"] and given["known_poses"] is None:
            raise click.UsageError("--exact-poses was given: --known-poses is needed with it", ctx)
        return cls(**given)

    def takes(self, path: str) -> bool:
        """Return whether a path is frames: any path if intrinsics were given, else a recording."""
        return self.intrinsics is not None or _holds_its_own(path)

    def read(self) -> tuple[str | None, ...]:
        """Return the files that are read in addition to the frames."""
        return (self.intrinsics, self.known_poses)

    def fused(
        self,
        frames: str | Sequence[str],
        threads: int,
        on_frame: Callable[[str], None],
        **more: Any,  # noqa: ANN401 - as `fuse` takes it
    ) -> Scan:
        """Fuse the frames into one scan."""
        from divespot.frames import fuse  # noqa: PLC0415 - slow to import

        return fuse(
            frames,
            self.intrinsics,
            self.known_poses,
            depth_scale=self.depth_scale,
            depth_kind=self.depth_kind,
            depth_topic=self.depth_topic,
            exact_poses=self.exact_poses,
            threads=threads,
            on_frame=on_frame,
            **more,
        )


def _paths(ctx: click.Context) -> tuple[str, ...]:
    """Return the paths of the command, which some commands call scans and others frames."""
    paths: tuple[str, ...] = ctx.params.get("scans") or ctx.params.get("frames") or ()
    return paths


def _holds_its_own(path: str) -> bool:
    """Return whether a path is a recording, which may hold intrinsics, or a folder of clouds."""
    from divespot.frames.recording import is_recording  # noqa: PLC0415 - slow to import
    from divespot.frames.source import holds_clouds  # noqa: PLC0415 - as above

    return is_recording(Path(path)) or holds_clouds(Path(path))
