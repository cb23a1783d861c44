"""A laser scanner on a tripod, at one set-up after another."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot.simulate.checks import require
from divespot.simulate.scene import Camera

if TYPE_CHECKING:
    from divespot.simulate.things import XY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tripod(Camera):
    """A rotating scanner: one frame per set-up; `pixels` are the steps of its angles.

    Parameters
    ----------
    stations_m
        Its positions in plan, as many as `frames`.
    elevations_deg
        Lowest and highest elevation of its rays.
    """

    stations_m: tuple[XY, ...] = ()
    elevations_deg: tuple[float, float] = (-60.0, 25.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            len(self.stations_m) == self.frames,
            f"Tripod.stations_m holds {len(self.stations_m)} places: {self.frames} are needed",
        )
        low, high = self.elevations_deg
        require(
            -90 <= low < high <= 90,
            f"Tripod.elevations_deg is {self.elevations_deg}: the lowest before the highest, from "
            "-90 to 90, is needed",
        )

    def lens(self, frame: int) -> Array:
        """(3,) position of the scanner in the scene."""
        return np.array([*self.stations_m[frame], self.height_m])

    def rays(self) -> Array:
        """(rows * columns, 3) unit vectors, evenly spaced in both angles."""
        columns, rows = self.pixels
        turn = 2 * math.pi * (np.arange(columns) + 0.5) / columns
        low, high = np.radians(self.elevations_deg)
        up = (low + (high - low) * (np.arange(rows) + 0.5) / rows)[:, None]
        parts = (np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up) + 0 * turn)
        return np.stack([part.ravel() for part in parts], axis=1)
