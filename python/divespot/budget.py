"""The uncertainty budget of a volume."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

#: Terms that all piles of a scan have in common: over many piles they add up.
COMMON = ("registration_m3", "base_m3", "scale_m3", "rounding_m3")


@dataclass(frozen=True)
class Budget:
    """Standard uncertainties of a volume, independent of each other (after the GUM).

    Attributes
    ----------
    noise_m3
        Noise of each cell's height, independent from cell to cell.
    registration_m3
        Height error common to all cells of a pile, left by registering frames.
    base_m3
        Uncertainty of the base's height.
    footprint_m3
        Uncertainty of where the pile ends.
    filled_m3
        Uncertainty of the filled cells, which were not seen.
    grid_m3
        Curvature of the surface within the cells.
    scale_m3
        Scale error of the sensor.
    rounding_m3
        Coordinates that were rounded in the file (see `divespot.rounding`).

    """

    noise_m3: float
    registration_m3: float
    base_m3: float
    footprint_m3: float
    filled_m3: float
    grid_m3: float
    scale_m3: float
    rounding_m3: float = 0.0

    def combined_m3(self) -> float:
        """Return the root of the sum of squares."""
        return math.hypot(*dataclasses.astuple(self))
