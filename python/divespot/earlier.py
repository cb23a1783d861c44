"""An earlier scan of the same site, or a saved base, with which a scan is compared."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.base_name import BaseName
from divespot.dot import dot
from divespot.errors import DivespotError
from divespot.filters import radius_filter
from divespot.grid import HeightMap, height_map
from divespot.ground_level import find_ground
from divespot.io import UNITS, read
from divespot.plane import rotation_to_z
from divespot.pose import Pose, find_pose
from divespot.settings import Settings, given
from divespot.stages import Stages
from divespot.surface import Surface, find_surface
from divespot.surface_outliers import drop_surface_outliers
from divespot.thinning import take_survey
from divespot.up import SMALL_TILT_DEG

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.intake import Cloud
    from divespot.spacing import Survey


#: If the planes of two scans differ by more than this angle, one is a floor and the other a wall.
WALL_DEG = 45.0

#: An earlier scan with more than this share of its points on one plane shows only an empty floor.
BARE_SHARE = 0.9

#: With points farther apart than this many cells, most cells are empty: the map is triangulated.
APART = 1.1


@dataclass(frozen=True, eq=False)
class Earlier:
    """An earlier scan in the cloud's own coordinates, with its survey and pose evidence."""

    path: str
    points: NDArray[np.float64]
    scan: Survey
    settings: Settings


@dataclass(frozen=True, eq=False)
class Seen:
    """An earlier scan in the level frame: its surface on the scan's grid, and points off it."""

    path: str
    grid: HeightMap
    loose: NDArray[np.float64]
    is_ground: NDArray[np.bool_]


def read_earlier(cloud: Cloud, settings: Settings) -> Earlier | None:
    """Read the earlier scan, if it is the base, and drop its outliers as for any scan.

    Raises
    ------
    DivespotError
        The file cannot be read, or too few points are left.

    """
    name = BaseName.parse(settings.base)
    if name is None or name.kind != "surface":
        return None
    found = read(name.path)
    in_metres = found.points if found.unit_stated else found.points * UNITS[cloud.source.unit]
    points, origin, *_ = _native.seen(in_metres, settings.threads)
    points = (points + (np.array(origin) - cloud.origin_m)) / (cloud.scale, cloud.scale, 1.0)
    try:
        scan, own = take_survey(points, found.quantum_m, _own(settings))
        points = points if settings.radius_m == 0.0 else radius_filter(points, scan, own)
        points, scan, own = drop_surface_outliers(points, scan, cloud, own)
    except DivespotError as error:
        raise DivespotError(f"{name.path}: {error}") from None
    return Earlier(name.path, points, scan, own)


def _own(settings: Settings) -> Settings:
    """Return settings for the earlier scan, without the lengths derived from the later scan."""
    inner = settings.stages
    return Settings(
        up=settings.up,
        max_tilt_deg=settings.max_tilt_deg,
        level=settings.level,
        seed=settings.seed,
        threads=settings.threads,
        stages=Stages(hypotheses=inner.hypotheses, min_neighbors=inner.min_neighbors),
    )


def common_pose(
    points: NDArray[np.float64],
    scan: Survey,
    earlier: Earlier | None,
    cloud: Cloud,
    settings: Settings,
) -> Pose:
    """Return the pose of the earlier scan if that is better, else that of the scan.

    Of an empty bin the level floor is in view, of a filled one only the material in it. But an
    empty floor alone does not show which side is up; the material in the later scan does.
    """
    pose = find_pose(points, scan, cloud, settings)
    if earlier is None or not settings.level:
        return pose
    other = find_pose(earlier.points, earlier.scan, cloud, earlier.settings)
    if _is_better(pose, other):
        return pose
    bare = other.plane.inliers > BARE_SHARE * len(earlier.points)
    if bare and dot(pose.plane.normal, other.plane.normal) < 0.0:
        other = _turned_over(other)
    near = np.abs(other.plane.heights_m(points)) <= given(settings.stages.plane_threshold_m)
    plane = dataclasses.replace(other.plane, inliers=int(near.sum()))
    return dataclasses.replace(other, plane=plane, warnings=pose.warnings)


def _is_better(pose: Pose, earlier: Pose) -> bool:
    """Return whether the scan's own pose is better: only it is level, or the other is a wall's."""
    own, other = (min(p.tilt_deg, 180.0 - p.tilt_deg) for p in (pose, earlier))
    along = abs(float(dot(pose.plane.normal, earlier.plane.normal)))
    apart = along < math.cos(math.radians(WALL_DEG))
    return own < other and (own <= SMALL_TILT_DEG or apart)


def _turned_over(pose: Pose) -> Pose:
    x, y, z = pose.plane.normal
    plane = dataclasses.replace(pose.plane, normal=(-x, -y, -z), offset_m=-pose.plane.offset_m)
    rotation = rotation_to_z(plane.normal)
    return dataclasses.replace(pose, plane=plane, rotation=rotation, tilt_deg=180.0 - pose.tilt_deg)


def map_earlier(
    earlier: Earlier | None, pose: Pose, surface: Surface, grid: HeightMap, settings: Settings
) -> Seen | None:
    """Walk the earlier scan's surface, and average it over the cells of the scan's grid.

    Raises
    ------
    DivespotError
        The earlier scan does not overlap the scan.

    """
    if earlier is None:
        return None
    level = pose.level(earlier.points, settings.threads)
    own = earlier.settings.changed(base=settings.base)
    try:
        walked = find_surface(level, earlier.scan, own)
    except DivespotError as error:
        raise DivespotError(f"base surface={earlier.path}: {error}") from None
    low, high = surface.points[:, :2].min(axis=0), surface.points[:, :2].max(axis=0)
    shared = ((level[:, :2] >= low) & (level[:, :2] <= high)).all(axis=1)
    # The scan's points are included, but masked out, so that both scans get the same grid.
    among = np.concatenate([surface.points, level[shared]])
    is_on = np.concatenate([np.zeros(len(surface.points), np.bool_), walked.is_on[shared]])
    coarse = earlier.scan.spacing_m > APART * grid.cell_m
    triangulated = coarse or "triangles" in (s.stages.surface for s in (settings, earlier.settings))
    if not is_on.any():
        raise DivespotError(
            f"base surface={earlier.path}: 0 usable points were given, a surface that overlaps "
            "the scan is needed"
        )
    found = height_map(among, grid.cell_m, triangulated=triangulated, mask=is_on)
    ground, _ = find_ground(found, earlier.scan, own)
    is_ground = (
        np.zeros(found.heights_m.size, np.bool_) if ground.is_ground is None else ground.is_ground
    )
    return Seen(earlier.path, found, level[shared & ~walked.is_on], is_ground)
