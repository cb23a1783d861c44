"""Products with the same bits on every machine: BLAS adds up as suits its processor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def dot(places: ArrayLike, direction: ArrayLike) -> NDArray[np.float64]:
    """Return how far places, shape ``(..., 3)``, lie along a direction, shape ``(3,)``."""
    x, y, z = np.moveaxis(np.asarray(places, np.float64), -1, 0)
    along = np.asarray(direction, np.float64)
    return np.asarray(x * along[0] + y * along[1] + z * along[2])


def twice_area(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Return twice the area of a ring, positive if it runs counter-clockwise."""
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
