"""Solids of known volume, standing on a floor and sampled on exact grids."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

Floats = NDArray[np.float64]

STEP_M = 2.0**-7
"""Distance between the points: a number that is exact in binary, like all coordinates."""


@dataclass(frozen=True)
class Solid:
    """Height above the floor as a function of x and y, and the volume it encloses."""

    height_m: Callable[[Floats, Floats], Floats]
    volume_m3: float


def _box(x: Floats, y: Floats) -> Floats:
    return np.where((np.abs(x) < 0.5) & (np.abs(y) < 0.25), 0.25, 0.0)


def _wedge(x: Floats, y: Floats) -> Floats:
    return np.where(np.abs(y) < 0.5, np.maximum(0.25 - np.abs(x) / 2, 0), 0.0)


def _cone(x: Floats, y: Floats) -> Floats:
    return np.asarray(np.maximum(0.25 - np.hypot(x, y) / 2, 0))


def _frustum(x: Floats, y: Floats) -> Floats:
    return np.asarray(np.clip(0.3125 - np.hypot(x, y) / 2, 0, 0.1875))


def _hemisphere(x: Floats, y: Floats) -> Floats:
    return np.sqrt(np.maximum(0.25 - x * x - y * y, 0))


SOLIDS: Mapping[str, Solid] = MappingProxyType(
    {
        "box": Solid(_box, 0.125),
        "wedge": Solid(_wedge, 0.125),
        "cone": Solid(_cone, pi * 0.25 / 12),
        "frustum": Solid(_frustum, pi * 0.1875 / 3 * (0.625**2 + 0.625 * 0.25 + 0.25**2)),
        "hemisphere": Solid(_hemisphere, 2 * pi * 0.125 / 3),
    }
)


def raster(half_x: int, half_y: int, step_m: float = STEP_M) -> tuple[Floats, Floats]:
    """Return x and y of the midpoints of (2 half_x, 2 half_y) squares around the origin."""
    x = (np.arange(-half_x, half_x) + 0.5) * step_m
    y = (np.arange(-half_y, half_y) + 0.5) * step_m
    columns, rows = np.meshgrid(x, y)
    return columns.ravel(), rows.ravel()


def sampled(
    solid: Solid, step_m: float = STEP_M, half_m: tuple[float, float] = (1, 0.875)
) -> Floats:
    """Return points on the solid and on the floor around it, heights in multiples of 2**-30."""
    x, y = raster(round(half_m[0] / step_m), round(half_m[1] / step_m), step_m)
    z = np.round(solid.height_m(x, y) * 2.0**30) / 2.0**30
    return np.column_stack([x, y, z])


def turned(points: Floats, angle_deg: float) -> Floats:
    """Return the points turned about z."""
    sin, cos = np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))
    return np.asarray(points @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]))
