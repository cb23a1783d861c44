"""Posture correction: the scan's frame, the level frame, and the way between (Algorithm 2)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.errors import DivespotError
from divespot.plane import Plane, cone, rotation_to_z
from divespot.report import Ground
from divespot.settings import given

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from divespot.intake import Cloud
    from divespot.objects import GroundLevel
    from divespot.report import Position
    from divespot.settings import Settings
    from divespot.spacing import Survey

#: Half of the flattest angle of repose: ground is no steeper.
GENTLE_DEG = 7.5

#: Beyond this angle to the ground's normal, a direction is no upward one.
STEEPEST_DEG = 60.0

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Pose:
    """How the ground lies in the scan.

    A point p of the cloud is at ``rotation @ p - (0, 0, offset_m)`` in the level frame, where the
    ground is z = 0 and up is +z.
    """

    plane: Plane
    rotation: NDArray[np.float64]
    tilt_deg: float

    def level(self, points: NDArray[np.float64], threads: int) -> NDArray[np.float64]:
        """Return points of the cloud in the level frame."""
        turned = _native.rotate(points, self.rotation.tolist(), threads)
        turned[:, 2] -= self.plane.offset_m
        return turned

    def restored(self, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places of the level frame, shape ``(..., 3)``, in the cloud's frame."""
        raised = positions_m + np.array((0.0, 0.0, self.plane.offset_m))
        return np.asarray(raised @ self.rotation)


def parse_up(up: str) -> tuple[float, float, float] | None:
    """Return the direction that `up` names; None for auto.

    Raises
    ------
    DivespotError
        The text is none of auto, x, y, z, -x, -y, -z and a,b,c.

    """
    if up == "auto":
        return None
    if up.lstrip("+-") in AXES and len(up) <= 2:
        sign = -1.0 if up.startswith("-") else 1.0
        x, y, z = AXES[up.lstrip("+-")]
        return sign * x, sign * y, sign * z
    try:
        x, y, z = (float(part) for part in up.split(","))
    except ValueError:
        raise DivespotError(
            f"up is {up!r}: auto, x, y, z, -x, -y, -z or three numbers a,b,c are needed"
        ) from None
    return x, y, z


def upward(normal: ArrayLike, up: str) -> NDArray[np.float64]:
    """Return the unit vector that is up; where nobody says, the axis nearest to the normal."""
    asked = parse_up(up)
    if asked is not None:
        return np.asarray(np.array(asked) / np.linalg.norm(asked))
    along = np.asarray(normal)
    nearest = int(np.abs(along).argmax())
    return np.asarray(np.copysign(1.0, along[nearest]) * np.array([*AXES.values()])[nearest])


def find_pose(points: NDArray[np.float64], survey: Survey, settings: Settings) -> Pose:
    """Find the ground plane and the rotation that lays it level.

    Of several planes the one is taken that has (nearly) nothing below it and on which something
    slopes as bulk material does; see the core's ``ground`` module. The paper takes the largest,
    which may be a wall. Inside an outline above a given height, or where only slopes were seen of
    what stands above it, level is what is upright to the direction that the height is along.

    Raises
    ------
    DivespotError
        No plane goes through the points, or none that is level enough.

    """
    up = parse_up(settings.up)
    if not settings.level:
        return _as_it_is(points, up or AXES["z"], given(settings.plane_threshold_m))
    parts, rotation = _native.find_ground(
        points,
        survey.at_m,
        survey.normals,
        given(settings.plane_threshold_m),
        settings.hypotheses,
        cone(up, settings.max_tilt_deg),
        settings.seed,
        settings.threads,
    )
    plane = Plane(*parts)
    tilt_deg = _angle_deg(plane.normal, up or AXES["z"])
    steep = up is not None and GENTLE_DEG < tilt_deg <= STEEPEST_DEG
    if settings.base.startswith("height=") and (steep or settings.outline is not None):
        plane = _upright(plane, points, settings)
        rotation = rotation_to_z(plane.normal)
    return Pose(plane, rotation, tilt_deg)


def _upright(plane: Plane, points: NDArray[np.float64], settings: Settings) -> Plane:
    """Return the plane across up through the middle of a plane's points.

    The sides of a prism are as high as the base is deep: they must run along the base's normal.
    """
    near = np.abs(plane.heights_m(points)) <= given(settings.plane_threshold_m)
    x, y, z = upward(plane.normal, settings.up).tolist()
    offset_m = float(points[near].mean(axis=0) @ (x, y, z))
    return dataclasses.replace(plane, normal=(x, y, z), offset_m=offset_m)


def _as_it_is(points: NDArray[np.float64], up: Position, threshold_m: float) -> Pose:
    """Return the pose of a scan that is taken as level, z = 0 at the middle one of its heights."""
    rotation = _native.rotation_to_z(up)
    heights = points @ rotation[2]
    offset = float(np.median(heights))
    off = np.abs(heights - offset)
    near = off[off <= threshold_m]
    x, y, z = rotation[2].tolist()
    plane = Plane((x, y, z), offset, len(near), math.sqrt(float((near * near).mean())))
    return Pose(plane, rotation, 0.0)


def ground_in_scan(pose: Pose, ground: GroundLevel, cloud: Cloud, points: int) -> Ground:
    """Describe the ground in the scan's own frame, in metres."""
    normal = pose.plane.normal
    offset = pose.plane.offset_m + ground.height_m + float(np.dot(normal, cloud.origin_m))
    return Ground(normal, offset, pose.tilt_deg, ground.noise_m, pose.plane.inliers / points)


def _angle_deg(a: Position, b: Position) -> float:
    cosine = np.dot(a, b) / np.linalg.norm(b)
    return math.degrees(math.acos(min(1.0, max(-1.0, float(cosine)))))
