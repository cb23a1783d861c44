"""What rounded coordinates add to the uncertainty of a volume.

A coordinate in steps of q is off by up to q / 2 either way, q / sqrt(12) in standard deviation.
What that does to a volume depends on whether the errors of many points are independent:

- Along up, points of a level floor all round to the same side, unless noise deals them out over the
  steps (dither). Noise of standard deviation s leaves exp(-2 pi² s² / q²) of the common error
  (Widrow and Kollár 2008, *Quantization Noise*, section 4.1), a floor that rises by d across the
  pile no more than q / (pi d) of it, as of any wave that is averaged over d.
- What is dealt out is independent from point to point.
- In plan, points move along the surface: by its slope that is an error in height, independent from
  point to point, since a flank runs over many steps. What is left where the flank ends is, for both
  sides of a pile on an area A, no more than mean height · q² / (2 sqrt(6)): each side is moved by
  q / sqrt(12), as above less by q / (pi R) on a flank of length R = sqrt(A / pi).
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

#: Standard deviation of what is rounded to whole numbers.
ROUNDED = 1.0 / math.sqrt(12.0)


@dataclass(frozen=True)
class Rounding:
    """Steps of the coordinates, and what tells how far their errors average out.

    Attributes
    ----------
    steps_m
        Steps along the axes of the scan, 0 where none is seen.
    up
        The unit vector up in the scan.
    spacing_m
        Distance between points.
    roughness_m
        Distance of a point from the surface around it, rounding included.

    """

    steps_m: tuple[float, float, float]
    up: tuple[float, float, float]
    spacing_m: float
    roughness_m: float

    @classmethod
    def of(cls, cloud: Cloud, pose: Pose, scan: Survey) -> Rounding:
        """Return how the points of a scan are rounded."""
        x, y, z = pose.rotation[2].tolist()
        return cls(cloud.quantum_m, (x, y, z), scan.spacing_m, scan.roughness_m)

    def u_m3(self, raw: RawObject) -> float:
        """Return the standard uncertainty of an object's volume by the rounding."""
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
        """Return the share of the error of steps along up that noise leaves."""
        if step_m == 0.0:
            return 0.0
        noise_m2 = self.roughness_m**2 - (ROUNDED * step_m) ** 2
        return math.exp(-2.0 * math.pi**2 * max(noise_m2, 0.0) / step_m**2)


def _averaged(step_m: float, over_m: float) -> float:
    """Return the share of a wave of length `step_m` that is left of its mean over a distance."""
    return min(step_m / (math.pi * over_m), 1.0) if over_m > 0.0 else 1.0
