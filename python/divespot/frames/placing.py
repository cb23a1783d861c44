"""Frames as ranges along rays, and where each of them lies on those before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from divespot import _native
from divespot.errors import DivespotError, NothingSeenError

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from divespot.frames.intrinsics import Intrinsics
    from divespot.frames.source import Frames

Kind: TypeAlias = Literal["planar", "radial"]
Pose: TypeAlias = "list[list[float]]"

#: Why a frame was left out, by the kernel's word for it.
REASONS = {
    "empty": "it shows too little",
    "overlap": "it shows too little of what was seen before",
    "fit": "it fits nowhere on what was seen before",
}


@dataclass(frozen=True, eq=False)
class View:
    """The frames, as ranges along rays.

    Attributes
    ----------
    source
        The frames.
    rays
        Unit vectors, shape ``(rows * columns, 3)``; NaN where the lens lets nothing through.
    per_depth
        Range in a unit of depth, shape ``(rows, columns)``.
    shape
        Rows and columns.

    """

    source: Frames
    rays: NDArray[np.float64]
    per_depth: NDArray[np.float32]
    shape: tuple[int, int]
    threads: int

    @classmethod
    def of(cls, source: Frames, lens: Intrinsics, kind: Kind, threads: int) -> View:
        """Look at the first frame for the size of all."""
        rows, columns = source[0].shape
        if min(rows, columns) < 3:
            raise DivespotError(
                f"{source.names[0]}: has {columns} x {rows} pixels: 3 x 3 are needed"
            )
        lens.require_size(rows, columns)
        rays = lens.rays(rows, columns)
        per_depth = np.ones(len(rays)) if kind == "radial" else 1.0 / rays[:, 2]
        shaped = per_depth.astype(np.float32).reshape(rows, columns)
        return cls(source, rays, shaped, (rows, columns), threads)

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

    def fusion(
        self, joint: _native.RawJoint, voxel_m: float | None, wide: float
    ) -> _native.RawFusion:
        """Return voxels to add frames to."""
        if voxel_m is None:
            voxel_m = wide * joint.range_m * self.pitch()
        return _native.RawFusion(
            self.rays, self.shape, voxel_m, joint.noise, joint.range_m, self.threads
        )

    def pitch(self) -> float:
        """Return the angle between the rays of neighbours in the middle of the image."""
        rows, columns = self.shape
        middle = rows // 2 * columns + columns // 2
        steps = self.rays[[middle - 1, middle - columns]] - self.rays[middle]
        return float(np.sqrt((steps**2).sum(axis=1)).max())


@dataclass
class Placed:
    """The frames as they were laid on each other, and what there is to say of it."""

    tracker: _native.RawTracker
    lost: list[tuple[int, str]]
    slid: list[tuple[int, tuple[float, float, float]]]


def place(
    view: View, given: NDArray[np.float64] | None, *, exact: bool, tell: Callable[[str], None]
) -> Placed:
    """Place the frames one by one, each on what was seen before.

    Raises
    ------
    NothingSeenError
        None of them shows a surface.

    """
    placed = Placed(_native.RawTracker(view.rays, view.shape, view.threads), [], [])
    for number in range(len(view.source)):
        tell(f"placing frame {number + 1} of {len(view.source)}")
        pose = None if given is None or np.isnan(given[number]).any() else _rows(given[number])
        if exact and pose is None:
            placed.lost.append((number, "no pose was given for it"))
            placed.tracker.add(np.zeros(view.shape, np.float32), None, exact=False)
            continue
        found, why = placed.tracker.add(view.ranges_m(number), pose, exact)
        if found is None:
            placed.lost.append((number, REASONS[why]))
        elif found[3] is not None:
            placed.slid.append((number, found[3]))
    if len(placed.lost) == len(view.source):
        number, why = placed.lost[0]
        raise NothingSeenError(
            f"{view.source.names[number]}: {why}, and no other frame shows more: depth of a "
            "surface within the camera's range is needed"
        )
    return placed


def _rows(pose: NDArray[np.float64]) -> Pose:
    rows: Pose = pose[:3].tolist()
    return rows
