"""Frames as ranges along rays, registered one after the other."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from divespot import _native
from divespot.cores import cores
from divespot.errors import DivespotError, NothingSeenError
from divespot.frames.ahead import ahead
from divespot.frames.views import Views

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from divespot.frames.intrinsics import Intrinsics
    from divespot.frames.source import Frames
    from divespot.frames.views import Frame, Pose

Kind: TypeAlias = Literal["planar", "radial"]

#: A frame that overlaps earlier ones by less than this share may fit in a wrong place.
SHARED = 0.5

#: Why a frame was left out, by the kernel's name for the reason.
REASONS = {
    "empty": "it shows too little",
    "overlap": "it overlaps earlier frames too little",
    "fit": "it does not fit earlier frames anywhere",
}


@dataclass(frozen=True, eq=False, kw_only=True)
class View(Views):
    """The frames of a camera, as ranges along its rays.

    Attributes
    ----------
    camera
        The camera's rays.
    per_depth
        Range per unit of depth, shape ``(rows, columns)``; NaN outside the lens.
    shape
        Rows and columns.

    """

    camera: _native.RawCamera
    per_depth: NDArray[np.float32]
    shape: tuple[int, int]

    @classmethod
    def of(cls, source: Frames, lens: Intrinsics, kind: Kind, threads: int) -> View:
        """Take the size of all frames from the first one."""
        rows, columns = source[0].shape
        if min(rows, columns) < 3:
            raise DivespotError(
                f"{source.names[0]}: has {columns} x {rows} pixels: 3 x 3 are needed"
            )
        lens.require_size(rows, columns)
        rays = lens.rays(rows, columns)
        per_depth = rays[:, 2] / rays[:, 2] if kind == "radial" else 1.0 / rays[:, 2]
        shaped = per_depth.astype(np.float32).reshape(rows, columns)
        shape = (rows, columns)
        return cls(
            source=source,
            pitch=_pitch(rays, shape),
            threads=threads,
            doubts=lens.doubts(rows, columns),
            camera=_native.RawCamera(rays, shape),
            per_depth=shaped,
            shape=shape,
        )

    def frame(self, number: int) -> Frame:
        """Return a frame: its camera and its ranges."""
        return self.camera, self.ranges_m(number)

    def ranges_m(self, number: int) -> NDArray[np.float32]:
        """Return the ranges of a frame."""
        depth = self.source[number]
        if depth.shape != self.shape:
            rows, columns = depth.shape
            raise DivespotError(
                f"{self.source.names[number]}: has {columns} x {rows} pixels: "
                f"{self.shape[1]} x {self.shape[0]}, as the first frame, are needed"
            )
        return np.asarray(depth * self.per_depth)


def _pitch(rays: NDArray[np.float64], shape: tuple[int, int]) -> float:
    rows, columns = shape
    middle = rows // 2 * columns + columns // 2
    steps = rays[[middle - 1, middle - columns]] - rays[middle]
    return float(np.sqrt((steps**2).sum(axis=1)).max())


@dataclass
class Placed:
    """The registered frames, and warnings about them."""

    tracker: _native.RawTracker
    cutter: _native.RawCutter
    lost: list[tuple[int, str]] = field(default_factory=list)
    slid: list[tuple[int, tuple[float, float, float]]] = field(default_factory=list)
    apart: list[tuple[int, float]] = field(default_factory=list)

    def note(
        self,
        number: int,
        overlap: float,
        _lying: float,
        _sigma_m: float,
        sliding: tuple[float, float, float] | None,
    ) -> None:
        """Record what is doubtful about a registered frame."""
        if sliding is not None:
            self.slid.append((number, sliding))
        if overlap < SHARED:
            self.apart.append((number, overlap))

    def solve(self, *, exact: bool = False) -> _native.RawJoint:
        """Solve for all poses."""
        return self.tracker.solve(self.cutter.noise(), exact)


def place(
    view: Views,
    given: NDArray[np.float64] | None = None,
    *,
    exact: bool = False,
    tell: Callable[[str], None] = lambda _text: None,
) -> Placed:
    """Register the frames one by one, each to all earlier ones.

    Raises
    ------
    NothingSeenError
        No frame shows a surface.

    """
    # The next frame is cut into patches while the previous one is registered.
    share = max(1, (view.threads or cores()) // 2)
    placed = Placed(_native.RawTracker(share), _native.RawCutter(share))
    poses = [_start(given, number) for number in range(len(view))]

    def cut(number: int) -> _native.RawPatches | None:
        is_needed = poses[number] is not None or not exact
        return placed.cutter.cut(*view.frame(number)) if is_needed else None

    for number, patches in enumerate(ahead(cut, range(len(view)), view.threads)):
        tell(f"registering frame {number + 1} of {len(view)}")
        found, why = placed.tracker.add(patches, poses[number], exact)
        if patches is None:
            placed.lost.append((number, "no pose was given for it"))
        elif found is None:
            placed.lost.append((number, REASONS[why]))
        else:
            placed.note(number, *found)
    if len(placed.lost) == len(view):
        number, why = placed.lost[0]
        raise NothingSeenError(
            f"{view.source.names[number]}: {why}, and no other frame shows more: depth of a "
            "surface within the camera's range is needed"
        )
    return placed


def _start(given: NDArray[np.float64] | None, number: int) -> Pose | None:
    """Return the pose that was given for a frame, if any."""
    if given is None or np.isnan(given[number]).any():
        return None
    rows: Pose = given[number][:3].tolist()
    return rows
