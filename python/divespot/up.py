"""Which way is up, the evidence for it, and conflicting evidence.

In this order: the given direction; the side of the ground on which the sensor was, if known; z in a
projected coordinate system; z if the floor is level in it; the side of the ground on which the scan
lies. The core's ``ground`` module compares planes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from divespot.directions import Z, angle_deg, parse_up
from divespot.plane import Plane, cone
from divespot.sensor import ORIGIN, axis_z, is_survey

if TYPE_CHECKING:
    from divespot.directions import Position
    from divespot.intake import Cloud
    from divespot.settings import Settings
    from divespot.spacing import Survey

UpFrom: TypeAlias = Literal["given", "sensor", "coordinate system", "small tilt", "nothing below"]

#: No bulk material lies flatter: the ground of a survey is searched among planes flatter than this.
LEVEL_DEG = 15.0

#: A direction farther than this from the ground's normal is not taken for up.
STEEPEST_DEG = 60.0

#: Loaded trucks climb 1 in 6 at most, 9.5°. If coordinates only look like those of a survey, and at
#: least half of the points lie on one plane steeper than this, the scan itself is tilted.
STEEPEST_YARD_DEG = 10.0
FLAT_SHARE = 0.5

#: A floor this near to the horizontal counts as level (the core's ``NEARLY_LEVEL_RAD``).
SMALL_TILT_DEG = 2.0


@dataclass(frozen=True)
class Evidence:
    """Evidence for up before the ground is searched for.

    Attributes
    ----------
    asked
        The approximate direction that the settings give.
    name
        The setting as the user typed it.
    sensor_m
        Position of the sensor in the cloud's frame.
    at_origin
        Whether this is the scan's origin, as in a sensor's own frame.
    z
        What z may be for a sensor at the origin.
    projected
        Whether the coordinates are those of a projected system.
    is_stated
        Whether the scan states its coordinate system.
    is_z
        Whether z is up by that system, and no given direction contradicts it.

    """

    asked: Position | None
    name: str
    sensor_m: Position | None
    at_origin: bool
    z: Literal["up", "ahead", "behind"]
    projected: bool
    is_stated: bool
    is_z: bool

    @classmethod
    def of(cls, survey: Survey, cloud: Cloud, settings: Settings) -> Evidence:
        """Collect the evidence."""
        asked = parse_up(settings.up)
        places_m = survey.at_m + cloud.origin_m
        projected = cloud.projected or is_survey(places_m)
        cone(asked, settings.max_tilt_deg)  # raises an error if it is not a direction
        agrees = asked is None or angle_deg(Z, asked) <= settings.max_tilt_deg
        sensor_m = None
        if cloud.sensor_m is not None:
            x, y, z = np.subtract(cloud.sensor_m, cloud.origin_m).tolist()
            sensor_m = (x, y, z)
        at_origin = cloud.sensor_m == ORIGIN
        return cls(
            asked,
            str(settings.up),
            sensor_m,
            at_origin,
            axis_z(places_m),
            projected,
            cloud.projected,
            projected and agrees,
        )

    def cone(self, max_tilt_deg: float) -> tuple[Position, float] | None:
        """Return the normals that the ground's plane may have, None for any."""
        return cone(Z, LEVEL_DEG) if self.is_z else cone(self.asked, max_tilt_deg)

    def is_exact(self, ground: Plane, points: int) -> bool:
        """Return whether up is exactly z, whatever the tilt of the ground's plane."""
        is_steep = angle_deg(ground.normal, Z) > STEEPEST_YARD_DEG
        is_tilted = is_steep and ground.inliers >= FLAT_SHARE * points and not self.is_stated
        return self.is_z and not is_tilted


@dataclass(frozen=True)
class Up:
    """The evidence that up was taken from, and the evidence against it."""

    evidence: Evidence
    plane: Plane
    found_from: UpFrom
    doubted: bool

    @property
    def source(self) -> UpFrom:
        """The evidence that decided."""
        by_system = self.evidence.is_z and self.evidence.asked is None
        return "coordinate system" if by_system else self.found_from

    def conflicts(self, threshold_m: float) -> tuple[str, ...]:
        """Return a sentence for each piece of conflicting evidence."""
        said = (self._with_the_system(), self._with_the_sensor(threshold_m), self._with_the_scan())
        return tuple(sentence for sentence in said if sentence is not None)

    def _with_the_system(self) -> str | None:
        if not self.evidence.projected:
            return None
        if self.evidence.is_z:
            return self._tilted()
        return (
            f"up was given as {self.evidence.name} and used, but the coordinates are those of a "
            "projected system, in which z is up"
        )

    def _tilted(self) -> str | None:
        off_deg = angle_deg(self.plane.normal, Z)
        if off_deg <= STEEPEST_YARD_DEG:
            return None
        return (
            "the coordinates look like those of a projected system, in which z is up, but the "
            f"ground is a plane {off_deg:.0f}° off: the scan was taken as tilted"
        )

    def _with_the_sensor(self, threshold_m: float) -> str | None:
        if self.evidence.sensor_m is None:
            return None
        height_m = float(self.plane.heights_m(np.array([self.evidence.sensor_m]))[0])
        if height_m < -threshold_m:
            reason = "given" if self.evidence.asked is not None else "z, as of a projected system"
            return (
                f"the sensor stood {-height_m:.3g} m below the ground, which it cannot see from "
                f"there: up was taken as {reason}"
            )
        is_level = self.plane.normal[2] < -math.cos(math.radians(SMALL_TILT_DEG))
        if self.source != "sensor" or self.evidence.at_origin or not is_level:
            return None
        return "the floor is level, but the sensor stood below it in z: -z was taken as up"

    def _with_the_scan(self) -> str | None:
        off_deg = angle_deg(self.plane.normal, (0.0, 0.0, -1.0))
        if self.source == "nothing below" and off_deg < LEVEL_DEG:
            return (
                f"up was taken as -z ({off_deg:.0f}° off), since then nothing lies below the "
                "ground: if z is up, what was measured are holes, and up=z is needed"
            )
        if not self.doubted or self.source not in REASONS:
            return None
        return (
            f"up was taken from {REASONS[self.source]}, but the scan seems to be upside down, with "
            "much below the ground: if it is, up is needed, as up=-z"
        )


#: Names, for warnings, of evidence that may be wrong.
REASONS = {
    "sensor": "the position of the sensor",
    "small tilt": "z, in which the floor is almost level",
}
