"""The uncertainty of a volume due to rounded coordinates.

A coordinate rounded to steps of q is off by at most q / 2, standard deviation q / sqrt(12).
The effect on a volume depends on whether the errors of many points are independent:

- Along up, all points of a level floor are rounded to the same side, unless noise spreads them over
  several steps (dither). Noise of standard deviation s leaves exp(-2 pi² s² / q²) of the common
  error (Widrow and Kollár 2008, *Quantization Noise*, section 4.1). A floor that rises by d across
  the pile leaves at most q / (pi d) of it, as for any wave averaged over d.
- The rest of the error is independent from point to point.
- In plan, points are shifted along the surface, which times its slope is an error in height,
  independent from point to point, since a flank covers many steps. What is left at the ends of the
  flanks, for both sides of a pile of area A, is at most mean height · q² / (2 sqrt(6)): each side
  is shifted by q / sqrt(12), reduced as above by q / (pi R) on a flank of length R = sqrt(A / pi).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from divespot._native import RawObject
    from divespot.intake import Cloud
    from divespot.pose import Pose
    from divespot.spacing import Survey

#: Standard deviation of the error of rounding to integers.
ROUNDED = 1.0 / math.sqrt(12.0)


@dataclass(frozen=True)
class Rounding:
    """Rounding steps of the coordinates, and the data that decide how far their errors average out.

    Attributes
    ----------
    steps_m
        Steps along the axes of the scan, 0 if there is no rounding.
    up
        The unit vector up in the scan.
    spacing_m
        Point spacing.
    roughness_m
        Typical distance of a point from the surface around it, rounding included.

    """

    steps_m: tuple[float, float, float]
    up: tuple[float, float, float]
    spacing_m: float
    roughness_m: float

    @classmethod
    def of(cls, cloud: Cloud, pose: Pose, scan: Survey) -> Rounding:
        """Return the rounding of a scan's points."""
        x, y, z = pose.rotation[2].tolist()
        return cls(cloud.quantum_m, (x, y, z), scan.spacing_m, scan.roughness_m)

    def u_m3(self, raw: RawObject) -> float:
        """Return the standard uncertainty of an object's volume due to rounding."""
        return math.hypot(*(self._along(axis, raw) for axis in range(3)))

    def _along(self, axis: int, raw: RawObject) -> float:
        step_m, area_m2 = self.steps_m[axis], raw.footprint_m2
        if step_m == 0.0 or area_m2 == 0.0:
            return 0.0
        upward = min(abs(self.up[axis]), 1.0)
        in_plan = math.sqrt(1.0 - upward * upward)
        radius_m = math.sqrt(area_m2 / math.pi)
        slope, mean_m = raw.max_height_m / radius_m, abs(raw.cut_m3 - raw.fill_m3) / area_m2
        u_m = ROUNDED * step_m
        rise_m = 2.0 * radius_m * in_plan
        common_m = u_m * upward * min(self._left(step_m * upward), _averaged(step_m, rise_m))
        own_m = u_m * (upward + slope * in_plan)
        ends_m3 = mean_m * (in_plan * step_m) ** 2 / (2.0 * math.sqrt(6.0))
        return math.hypot(common_m * area_m2, own_m * self.spacing_m * math.sqrt(area_m2), ends_m3)

    def _left(self, step_m: float) -> float:
        """Return the share of the common rounding error along up that noise leaves."""
        if step_m == 0.0:
            return 0.0
        noise_m2 = self.roughness_m**2 - (ROUNDED * step_m) ** 2
        return math.exp(-2.0 * math.pi**2 * max(noise_m2, 0.0) / step_m**2)


def _averaged(step_m: float, over_m: float) -> float:
    """Return the share of a wave of length `step_m` left in its mean over a distance."""
    return min(step_m / (math.pi * over_m), 1.0) if over_m > 0.0 else 1.0
