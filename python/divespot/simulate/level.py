"""Parts of the ground that are higher or lower than the rest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from divespot.simulate.checks import require, require_positive

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Level:
    """A terrace, ditch, pit or platform: ground that rises or falls from its rim, then is level.

    Parameters
    ----------
    center_m, half_m
        Centre in plan, and half of its length and width; infinite for an endless part.
    rise_m
        Height of its level part above the ground around it; negative for a hole.
    face_deg
        Angle of the faces between its level part and the ground around it.
    heading_deg
        Direction of its length, from x.
    rounded
        Whether its rim is a circle of radius `half_m[0]`, not a rectangle.
    under_piles
        Whether piles may lie on its faces; otherwise they lie beside it or within it.
    """

    center_m: tuple[float, float]
    half_m: tuple[float, float]
    rise_m: float
    face_deg: float = 75.0
    heading_deg: float = 0.0
    rounded: bool = False
    under_piles: bool = False

    def __post_init__(self) -> None:
        require(
            0 < self.face_deg < 88,
            f"Level.face_deg is {self.face_deg}: an angle above 0 and below 88 is needed",
        )
        require(
            min(self.half_m) > 0,
            f"Level.half_m is {self.half_m}: two numbers above 0 are needed",
        )
        require_positive(self, "size_m")

    @property
    def size_m(self) -> float:
        """Height of its faces."""
        return abs(self.rise_m)

    def heights(self, x: Array, y: Array) -> Array:
        """Heights that it adds to the ground at positions in plan."""
        turn = math.radians(self.heading_deg)
        dx, dy = x - self.center_m[0], y - self.center_m[1]
        along = dx * math.cos(turn) + dy * math.sin(turn)
        across = dy * math.cos(turn) - dx * math.sin(turn)
        if self.rounded:
            within = self.half_m[0] - np.hypot(along, across)
        else:
            within = np.minimum(self.half_m[0] - np.abs(along), self.half_m[1] - np.abs(across))
        reached = np.clip(within * math.tan(math.radians(self.face_deg)), 0.0, self.size_m)
        return np.asarray(math.copysign(1.0, self.rise_m) * reached)
