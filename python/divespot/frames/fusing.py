"""Fusing frames into a scan: registration, joint solution, adding up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot._arguments import number, switch, thread_number, word
from divespot.errors import DivespotError, NothingSeenError
from divespot.frames.ahead import ahead
from divespot.frames.clouds import CloudView
from divespot.frames.intrinsics import Given, Intrinsics
from divespot.frames.placing import View, place
from divespot.frames.poses import Poses, as_poses
from divespot.frames.source import Depth, Frames
from divespot.frames.telling import far, lost, slid, stood, warnings_of
from divespot.io.scan import Registration, Scan

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from divespot.frames.placing import Kind, Placed
    from divespot.frames.views import Pose, Views

#: A camera is still if it moved by less than this share of its range, and turned by less.
STILL, STILL_RAD = 0.003, 0.003
#: Edge of a voxel in pixel footprints: about four pixels of a frame fall into one.
FOOTPRINTS = 2.0
#: The same for a single frame, whose pixels should stay separate.
ONE_FRAME = 0.6
#: Fewest points of a scan.
FEWEST = 10


def fuse(  # noqa: PLR0913 - one keyword an option
    depth: Depth,
    intrinsics: Given | None = None,
    poses: Poses | None = None,
    *,
    depth_scale: float | None = None,
    depth_kind: Kind = "planar",
    depth_topic: str | None = None,
    exact_poses: bool = False,
    voxel_m: float | None = None,
    threads: int = 0,
    on_frame: Callable[[str], None] | None = None,
) -> Scan:
    """Fuse depth frames into one scan.

    Parameters
    ----------
    depth
        A folder or list of 16-bit PNG or TIFF images (extra ``frames``), NPY or NPZ files, or
        arrays of shape ``(h, w)`` or ``(n, h, w)``, in the order they were taken; or a folder or
        list of clouds, PCD or PLY, each in the axes of its sensor at the origin; or a recording:
        rosbag or MCAP (extra ``frames``), MKV of Azure Kinect (extra ``kinect``).
    intrinsics
        The camera's: see `divespot.frames.Intrinsics.of`. By default those that a recording holds.
    poses
        From each camera (x right, y down, z ahead) to a common frame: an array ``(n, 4, 4)`` or
        a file (TUM, KITTI, 4 × 4). They are starting values, unless `exact_poses` is set.
    depth_scale
        Metres per unit of depth; by default 0.001 for integers, 1 for floats.
    depth_kind
        ``"planar"``: depth along the optical axis; ``"radial"``: along the ray.
    depth_topic
        Topic of a ROS recording to read, if several hold depth.
    exact_poses
        Use the poses unchanged.
    voxel_m
        Edge of the voxels in which pixels are averaged; by default two pixels wide.
    threads
        Number of threads, which does not change the result; 0: all available to the process.
    on_frame
        Called with a text that says what is being done.

    Returns
    -------
    scan
        The points, with z up and the floor at 0 if it is in view (or in the frame of exact poses);
        `Scan.registration` holds the uncertainty of the registration.

    Raises
    ------
    DivespotError
        Frames, intrinsics or poses cannot be read or do not fit together, or too little of a
        surface is seen.

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
    if word("depth_kind", depth_kind) not in ("planar", "radial"):
        raise DivespotError(f"depth_kind is {depth_kind!r}: planar or radial is needed")
    if voxel_m is not None and not 0.0 < number("voxel_m", voxel_m) < math.inf:
        raise DivespotError(f"voxel_m is {voxel_m}: an edge in metres, above 0, is needed")
    source = Frames.of(depth, depth_scale, depth_topic)
    given = None if poses is None else as_poses(poses, len(source), source.times_s)
    if switch("exact_poses", exact_poses) and given is None:
        raise DivespotError("exact_poses was given: poses are needed with it")
    view = _view(source, intrinsics, depth_kind, thread_number(threads))
    tell = on_frame or (lambda _text: None)
    placed = place(view, given, exact=exact_poses, tell=tell)
    tell("solving for all poses")
    joint = placed.solve(exact=exact_poses)
    if isinstance(view, View) and not exact_poses and _stands_still(joint):
        return _still(view, joint, placed, voxel_m)
    return _fused(view, joint, placed, voxel_m, tell)


def _view(source: Frames, intrinsics: Given | None, kind: Kind, threads: int) -> Views:
    """Return the frames as ranges along rays."""
    if not source.is_clouds:
        lens = _lens(source) if intrinsics is None else Intrinsics.of(intrinsics)
        return View.of(source, lens, kind, threads)
    if intrinsics is not None or source.step_m is not None:
        raise DivespotError(
            f"{source.names[0]}: is a cloud, to which intrinsics or depth_scale were given: "
            "depth images are needed for those"
        )
    return CloudView.of(source, threads)


def _lens(source: Frames) -> Intrinsics:
    """Return the intrinsics of a recording."""
    if isinstance(source.intrinsics, str):
        raise DivespotError(
            f"{source.path or 'the frames'}: {source.intrinsics}: those of the camera that took "
            "the depth are needed (--intrinsics)"
        )
    return source.intrinsics


def _stands_still(joint: _native.RawJoint) -> bool:
    """Return whether the camera did not move."""
    poses = [np.array(pose) for pose in joint.poses if pose is not None]
    if len(poses) < 2:
        return False
    moved = max(float(np.abs(pose[:, 3] - poses[0][:, 3]).max()) for pose in poses)
    turned = max(float(np.abs(pose[:, :3] - poses[0][:, :3]).max()) for pose in poses)
    return moved < STILL * joint.range_m and turned < STILL_RAD


def _fused(
    view: Views,
    joint: _native.RawJoint,
    placed: Placed,
    voxel_m: float | None,
    tell: Callable[[str], None],
) -> Scan:
    poses = {at: pose for at, pose in enumerate(joint.poses) if pose is not None}
    kept = list(poses)
    fusion = view.fusion(joint, voxel_m, FOOTPRINTS if len(kept) > 1 else ONE_FRAME)
    for at, frame in zip(kept, ahead(view.frame, kept, view.threads), strict=True):
        tell(f"fusing frame {at + 1} of {len(view)}")
        if not joint.solved[at]:
            poses[at] = placed.tracker.settled(at, placed.cutter.cut(*frame))
        fusion.add(*frame, poses[at], joint.offsets_m[at])
    scale = _u_scale(joint)
    found = Registration(
        frames=len(kept),
        u_height_m=joint.u_height_m,
        u_place_m=joint.u_place_m,
        place_m=joint.place_m,
        u_scale=scale,
        between_m=joint.between_m,
        offset_m=joint.offset_m,
        u_offset_m=joint.u_offset_m,
        loops=joint.loops,
        left_out=tuple(view.source.names[at] for at, _ in placed.lost),
        poses=_matrices([poses.get(at) for at in range(len(view))]),
        is_still=False,
        times_s=view.source.times_s,
    )
    return _scan(view, fusion, found, warnings_of(view, joint, placed))


def _still(view: View, joint: _native.RawJoint, placed: Placed, voxel_m: float | None) -> Scan:
    """Average the frames of a camera that did not move: vote on the surface, then average."""
    kept = [at for at, pose in enumerate(joint.poses) if pose is not None]
    still = _native.RawStill(view.shape, joint.noise, view.threads)
    for frame in ahead(view.frame, kept, view.threads):
        still.vote(*frame)
    for frame in ahead(view.frame, kept, view.threads):
        still.add(*frame)
    ranges_m, _, between_m, left_out = still.averaged()
    fusion = view.fusion(joint, voxel_m, ONE_FRAME)
    pose = next(pose for pose in joint.poses if pose is not None)
    fusion.add(view.camera, ranges_m, pose, joint.offset_m)
    # Errors of single frames fall with their number; the camera's own offset does not.
    u_mean_m = between_m / math.sqrt(len(kept))
    found = Registration(
        frames=len(kept),
        u_height_m=u_mean_m,
        u_place_m=0.0,
        place_m=joint.place_m,
        u_scale=_u_scale(joint),
        between_m=between_m,
        offset_m=joint.offset_m,
        u_offset_m=joint.u_offset_m,
        loops=0,
        left_out=tuple(view.source.names[number] for number, _ in placed.lost),
        poses=_matrices([pose if number in kept else None for number in range(len(view.source))]),
        is_still=True,
        times_s=view.source.times_s,
    )
    warnings = (
        *view.doubts,
        *lost(view, placed),
        *slid(view, joint, placed),
        *far(view, joint),
        stood(len(kept), left_out),
    )
    return _scan(view, fusion, found, warnings)


def _u_scale(joint: _native.RawJoint) -> float:
    """Return the relative uncertainty of volumes due to the offset common to all ranges.

    An offset scales both axes in plan at a given range.
    """
    return 2.0 * joint.u_offset_m / joint.range_m


def _matrices(poses: Sequence[Pose | None]) -> tuple[NDArray[np.float64] | None, ...]:
    last = [[0.0, 0.0, 0.0, 1.0]]
    return tuple(None if pose is None else np.array([*pose, *last]) for pose in poses)


def _scan(
    view: Views,
    fusion: _native.RawFusion,
    found: Registration,
    warnings: tuple[str, ...],
) -> Scan:
    points, _, _, _ = fusion.points()
    if len(points) < FEWEST:
        raise NothingSeenError(
            f"{view.source.names[0]}: the frames show {len(points)} points: at least {FEWEST} are "
            "needed"
        )
    places = np.array([pose[:3, 3] for pose in found.poses if pose is not None])
    x, y, z = places.mean(axis=0).tolist()
    return Scan(
        points=points,
        path=view.source.path,
        unit="m",
        unit_stated=True,
        crs=None,
        warnings=warnings,
        viewpoint_m=(x, y, z),
        format="clouds" if view.source.is_clouds else "depth frames",
        sensors_m=places,
        registration=found,
    )
