"""Posture correction: the level frame, and conversion from the scan's frame (Algorithm 2)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.directions import Z, angle_deg, upward
from divespot.dot import dot
from divespot.errors import NoGroundError
from divespot.plane import Plane
from divespot.settings import given, needs_ground
from divespot.up import LEVEL_DEG, STEEPEST_DEG, Evidence, Up

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.directions import Position
    from divespot.intake import Cloud
    from divespot.settings import Settings
    from divespot.spacing import Survey
    from divespot.up import UpFrom


@dataclass(frozen=True, eq=False)
class Pose:
    """The position and direction of the ground in the scan.

    A point p of the cloud is at ``rotation @ p - (0, 0, offset_m)`` in the level frame, where the
    ground is z = 0 and up is +z. `tilt_deg` is the angle between z, or the given up, and the normal
    of the plane that fits the ground; in a projected system the ground is not turned level.
    """

    plane: Plane
    rotation: NDArray[np.float64]
    tilt_deg: float
    up_from: UpFrom
    warnings: tuple[str, ...] = ()

    def level(self, points: NDArray[np.float64], threads: int) -> NDArray[np.float64]:
        """Return points of the cloud in the level frame."""
        return self.laid_level(np.array(points, np.float64, order="C"), threads)

    def laid_level(self, points: NDArray[np.float64], threads: int) -> NDArray[np.float64]:
        """Return the same array, with its points overwritten by those in the level frame."""
        _native.level(points, self.rotation.tolist(), self.plane.offset_m, threads)
        return points

    def restored(self, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return positions of the level frame, shape ``(..., 3)``, in the cloud's frame."""
        raised = positions_m + np.array((0.0, 0.0, self.plane.offset_m))
        return np.stack([dot(raised, column) for column in self.rotation.T], axis=-1)


def find_pose(
    points: NDArray[np.float64], survey: Survey, cloud: Cloud, settings: Settings
) -> Pose:
    """Find the ground plane and the rotation that makes it level.

    Up is found from evidence (see `divespot.up`). In a projected coordinate system it is z, and
    nothing is turned, since a pit or a terrace would tilt a plane. Elsewhere the ground's own
    plane is made level; of several planes, the ground is the one that has (almost) nothing below
    it and something on it that slopes as bulk material does; see the core's ``ground`` module. The
    paper takes the largest plane, which may be a wall. With ``base="height=H"`` inside an outline,
    or where only slopes were seen, up is exactly the direction in which that height is measured.

    Raises
    ------
    DivespotError
        No plane goes through the points, or none that is level enough.

    """
    evidence = Evidence.of(survey, cloud, settings)
    threshold_m = given(settings.stages.plane_threshold_m)
    if not settings.level:
        return _as_it_is(points, evidence.asked or Z, threshold_m)
    parts, found_from, doubted = _native.find_ground(
        points,
        survey.at_m,
        survey.normals,
        threshold_m,
        settings.stages.hypotheses,
        evidence.cone(settings.max_tilt_deg),
        evidence.sensor_m,
        evidence.z,
        settings.seed,
        settings.threads,
    )
    fitted = Plane(*parts)
    plane = _upright(fitted, points, evidence, settings)
    rotation = _native.leveling(points, plane.normal, settings.threads)
    up = Up(evidence, plane, found_from, doubted=doubted)
    is_flat = fitted.inliers >= FLAT_SHARE * len(points)
    if needs_ground(settings) and up.source == "nothing below" and not is_flat:
        share = fitted.inliers / len(points)
        raise NoGroundError(
            f"which way is up cannot be told: only {share:.0%} of the points lie on one plane, "
            "and there is no other evidence (--up is needed, or a scan that shows the ground)"
        )
    tilt_deg = angle_deg(fitted.normal, evidence.asked or Z)
    return Pose(plane, rotation, tilt_deg, up.source, up.conflicts(threshold_m))


#: With a smaller share of the points on the ground's plane, the ground may be uneven.
FLAT_SHARE = 0.2


def _upright(
    plane: Plane, points: NDArray[np.float64], evidence: Evidence, settings: Settings
) -> Plane:
    """Return the plane perpendicular to up through the middle of a plane's points, if up is exact.

    Up is exact in a projected system. It must be so too where a volume is a prism between an
    outline and a given height, since the prism's sides run in the direction of that height.
    """
    asked = evidence.asked
    steep = asked is not None and LEVEL_DEG < angle_deg(plane.normal, asked) <= STEEPEST_DEG
    prisms = settings.base.startswith("height=") and (steep or settings.is_outlined)
    is_exact = evidence.is_exact(plane, len(points))
    if not (is_exact or prisms):
        return plane
    x, y, z = Z if is_exact else upward(plane.normal, settings.up).tolist()
    near = np.abs(plane.heights_m(points)) <= given(settings.stages.plane_threshold_m)
    offset_m = float(np.median(dot(points[near], (x, y, z))))
    return dataclasses.replace(plane, normal=(x, y, z), offset_m=offset_m)


def _as_it_is(points: NDArray[np.float64], up: Position, threshold_m: float) -> Pose:
    """Return the pose of a scan that is already level, with z = 0 at its median height."""
    rotation = _native.rotation_to_z(up)
    heights = dot(points, rotation[2])
    offset = float(np.median(heights))
    off = np.abs(heights - offset)
    near = off[off <= threshold_m]
    x, y, z = rotation[2].tolist()
    plane = Plane((x, y, z), offset, len(near), math.sqrt(float((near * near).mean())))
    return Pose(plane, rotation, 0.0, "given")
