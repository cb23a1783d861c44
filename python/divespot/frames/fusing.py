"""Frames in, a scan out: placed one by one, solved for together, then added up."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from divespot import _native
from divespot._arguments import thread_number
from divespot.errors import DivespotError, NothingSeenError
from divespot.frames.intrinsics import Given, Intrinsics
from divespot.frames.poses import Poses, as_poses
from divespot.frames.source import Depth, Frames
from divespot.io.scan import Registration, Scan

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

Kind: TypeAlias = Literal["planar", "radial"]
Pose: TypeAlias = "list[list[float]]"

#: A camera stands still if it moved by less than this part of its range, and turned by less.
STILL, STILL_RAD = 0.003, 0.003
#: Most pixels of all frames of a camera that stands still that are averaged at once.
MOST_PIXELS = 1 << 25
#: Edge of a voxel in pixels' footprints: about four of a frame fall into one.
FOOTPRINTS = 2.0
#: The same where only one frame is left, whose pixels are to stay apart.
ONE_FRAME = 0.6
#: Why a frame was left out, by the kernel's word for it.
REASONS = {
    "empty": "it shows too little",
    "overlap": "it shows too little of what was seen before",
    "fit": "it fits nowhere on what was seen before",
}
#: Frames that are named in a warning; of more, their number is said.
NAMED = 5
#: Fewest points of a scan.
FEWEST = 10


def fuse(  # noqa: PLR0913 - one keyword an option
    depth: Depth,
    intrinsics: Given,
    poses: Poses | None = None,
    *,
    depth_scale: float | None = None,
    depth_kind: Kind = "planar",
    exact_poses: bool = False,
    voxel_m: float | None = None,
    threads: int = 0,
    on_frame: Callable[[str], None] | None = None,
) -> Scan:
    """Put depth frames together.

    Parameters
    ----------
    depth
        A folder or list of 16-bit PNG or TIFF images (extra ``frames``), NPY or NPZ files, or
        arrays of shape ``(h, w)`` or ``(n, h, w)``, in the order they were taken.
    intrinsics
        The camera's: see `divespot.frames.Intrinsics.of`.
    poses
        From each camera (x right, y down, z ahead) into a common frame: an array ``(n, 4, 4)`` or
        a file (TUM, KITTI, 4 × 4). They are where the search begins, unless they are exact.
    depth_scale
        Metres in a unit of depth; by default 0.001 for whole numbers, 1 for others.
    depth_kind
        ``"planar"``: depth along the optical axis; ``"radial"``: along the ray.
    exact_poses
        Take the poses as they are.
    voxel_m
        Edge of the voxels in which pixels are averaged; by default two pixels wide.
    threads
        Threads to use, for the same bits; 0: as many as the process may.
    on_frame
        Called with what is being done.

    Returns
    -------
    scan
        The points, z up and the floor at 0 where one is in view (or in the frame of poses that are
        exact), and in `Scan.registration` how well the frames fit.

    Raises
    ------
    DivespotError
        Frames, intrinsics or poses cannot be read or do not belong together, or too little is
        seen.

    Examples
    --------
    >>> import divespot
    >>> from divespot import frames, simulate
    >>> taken = simulate.frames("shape-05", density=0.1)
    >>> scan = frames.fuse(taken.depth, taken.matrix)
    >>> scan.registration.frames
    4
    >>> abs(divespot.measure(scan).total.volume_m3 / taken.volume_m3 - 1) < 0.05
    True

    """
    if depth_kind not in ("planar", "radial"):
        raise DivespotError(f"depth_kind is {depth_kind!r}: planar or radial is needed")
    source, lens = Frames.of(depth, depth_scale), Intrinsics.of(intrinsics)
    given = None if poses is None else as_poses(poses, len(source), source.times_s)
    if exact_poses and given is None:
        raise DivespotError("exact_poses needs poses")
    view = View.of(source, lens, depth_kind, thread_number(threads))
    tell = on_frame or (lambda _text: None)
    placed = _placed(view, given, exact=exact_poses, tell=tell)
    tell("solving for all poses")
    joint = placed.tracker.solve(exact_poses)
    if not exact_poses and _stands_still(joint):
        return _still(view, joint, placed, voxel_m)
    return _fused(view, joint, placed, voxel_m, tell)


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

    def fusion(self, joint: _native.RawJoint, voxel_m: float | None, wide: float) -> Any:  # noqa: ANN401 - of the native module
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

    tracker: Any
    lost: list[tuple[int, str]]
    slid: list[int]
    direction: tuple[float, float, float] | None


def _placed(
    view: View, given: NDArray[np.float64] | None, *, exact: bool, tell: Callable[[str], None]
) -> Placed:
    placed = Placed(_native.RawTracker(view.rays, view.shape, view.threads), [], [], None)
    for number in range(len(view.source)):
        tell(f"placing frame {number + 1} of {len(view.source)}")
        pose = None if given is None or np.isnan(given[number]).any() else _rows(given[number])
        if exact and pose is None:
            placed.lost.append((number, "no pose was given for it"))
            placed.tracker.add(np.zeros(view.shape, np.float32), None, False)  # noqa: FBT003 - native
            continue
        found, why = placed.tracker.add(view.ranges_m(number), pose, exact)
        if found is None:
            placed.lost.append((number, REASONS[why]))
        elif found[3] is not None:
            placed.slid.append(number)
            placed.direction = found[3]
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


def _stands_still(joint: _native.RawJoint) -> bool:
    """Return whether the camera did not move."""
    poses = [np.array(pose) for pose in joint.poses if pose is not None]
    if len(poses) < 2:
        return False
    moved = max(float(np.abs(pose[:, 3] - poses[0][:, 3]).max()) for pose in poses)
    turned = max(float(np.abs(pose[:, :3] - poses[0][:, :3]).max()) for pose in poses)
    return moved < STILL * joint.range_m and turned < STILL_RAD


def _fused(
    view: View,
    joint: _native.RawJoint,
    placed: Placed,
    voxel_m: float | None,
    tell: Callable[[str], None],
) -> Scan:
    kept = [number for number, pose in enumerate(joint.poses) if pose is not None]
    fusion = view.fusion(joint, voxel_m, FOOTPRINTS if len(kept) > 1 else ONE_FRAME)
    for number in kept:
        tell(f"fusing frame {number + 1} of {len(view.source)}")
        fusion.add(view.ranges_m(number), joint.poses[number], joint.offsets_m[number])
    scale = _u_scale(joint)
    found = Registration(
        frames=len(kept),
        u_height_m=joint.u_height_m,
        u_scale=scale,
        between_m=joint.between_m,
        offset_m=joint.offset_m,
        u_offset_m=joint.u_offset_m,
        loops=joint.loops,
        left_out=tuple(view.source.names[number] for number, _ in placed.lost),
        poses=_matrices(joint.poses),
        is_still=False,
    )
    return _scan(view, fusion, found, _warnings(view, joint, placed))


def _still(
    view: View, joint: _native.RawJoint, placed: Placed, voxel_m: float | None
) -> Scan:
    """Average the frames of a camera that did not move, in groups that fit into memory."""
    kept = [number for number, pose in enumerate(joint.poses) if pose is not None]
    pixels = view.shape[0] * view.shape[1]
    groups = math.ceil(len(kept) * pixels / MOST_PIXELS)
    means, betweens, left_out = [], [], []
    for group in np.array_split(np.array(kept), groups):
        stack = np.stack([view.ranges_m(int(number)).ravel() for number in group])
        mean, _, _, between_m, out = _native.average_frames(stack, view.shape[1], view.threads)
        means.append(mean)
        betweens.append(between_m)
        left_out.append(out)
    ranges_m = means[0] if groups == 1 else _mean(means)
    fusion = view.fusion(joint, voxel_m, ONE_FRAME)
    pose = joint.poses[kept[0]]
    fusion.add(ranges_m, pose, joint.offset_m)
    # What frames have in common falls with their number; the camera's own offset does not.
    u_mean_m = float(np.mean(betweens)) / math.sqrt(len(kept))
    found = Registration(
        frames=len(kept),
        u_height_m=u_mean_m,
        u_scale=_u_scale(joint),
        between_m=float(np.mean(betweens)),
        offset_m=joint.offset_m,
        u_offset_m=joint.u_offset_m,
        loops=0,
        left_out=tuple(view.source.names[number] for number, _ in placed.lost),
        poses=_matrices([pose if number in kept else None for number in range(len(view.source))]),
        is_still=True,
    )
    warnings = (
        *_lost(view, placed),
        f"the camera stood still: {len(kept)} frames were averaged, "
        f"{float(np.mean(left_out)):.1%} of their pixels left out as moving or stray; noise falls "
        "with the root of their number, the camera's own bias does not",
    )
    return _scan(view, fusion, found, warnings)


def _mean(means: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    with np.errstate(invalid="ignore"):
        stack = np.stack(means)
        count = np.isfinite(stack).sum(axis=0)
        return np.asarray(np.nansum(stack, axis=0) / np.where(count, count, np.nan), np.float32)


def _u_scale(joint: _native.RawJoint) -> float:
    """Return the relative uncertainty of volumes by the offset of all ranges.

    An offset stretches what lies at a range across both axes of the plan.
    """
    return 2.0 * joint.u_offset_m / joint.range_m


def _matrices(poses: Sequence[Pose | None]) -> tuple[NDArray[np.float64] | None, ...]:
    last = [[0.0, 0.0, 0.0, 1.0]]
    return tuple(None if pose is None else np.array([*pose, *last]) for pose in poses)


def _scan(view: View, fusion: Any, found: Registration, warnings: tuple[str, ...]) -> Scan:  # noqa: ANN401 - of the native module
    points, _, _, _ = fusion.points()
    if len(points) < FEWEST:
        raise NothingSeenError(f"{view.source.names[0]}: the frames show {len(points)} points")
    places = np.array([pose[:3, 3] for pose in found.poses if pose is not None])
    x, y, z = places.mean(axis=0).tolist()
    return Scan(
        points=points,
        path=None,
        unit="m",
        unit_stated=True,
        crs=None,
        warnings=warnings,
        viewpoint_m=(x, y, z),
        format="depth frames",
        sensors_m=places,
        registration=found,
    )


def _warnings(view: View, joint: _native.RawJoint, placed: Placed) -> tuple[str, ...]:
    said = list(_lost(view, placed))
    if placed.slid:
        x, y, z = placed.direction or (0.0, 0.0, 0.0)
        said.append(
            f"{_frames([n + 1 for n in placed.slid])}: nothing that is seen tells how far the "
            f"camera moved along ({x:.2f}, {y:.2f}, {z:.2f}), as over a bare floor: it was taken "
            "as expected; something that stands out, or poses, are needed"
        )
    if len(view.source) > 1 and not joint.has_floor:
        said.append("no floor is in view: heights of frames were matched to each other only")
    return tuple(said)


def _lost(view: View, placed: Placed) -> tuple[str, ...]:
    said = []
    for why, count in Counter(why for _, why in placed.lost).items():
        numbers = [number for number, reason in placed.lost if reason == why]
        named = ", ".join(view.source.names[number] for number in numbers[:NAMED])
        more = f" and {count - NAMED} more" if count > NAMED else ""
        said.append(f"{named}{more}: left out: {why}")
    return tuple(said)


def _frames(numbers: Sequence[int]) -> str:
    named = ", ".join(map(str, numbers[:NAMED]))
    more = f" and {len(numbers) - NAMED} more" if len(numbers) > NAMED else ""
    return f"frame {named}" if len(numbers) == 1 else f"frames {named}{more}"
