"""Products with the same bits on every machine; BLAS sums in an order that depends on the CPU."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def dot(places: ArrayLike, direction: ArrayLike) -> NDArray[np.float64]:
    """Return positions, shape ``(..., 3)``, projected on a direction, shape ``(3,)``."""
    x, y, z = np.moveaxis(np.asarray(places, np.float64), -1, 0)
    along = np.asarray(direction, np.float64)
    return np.asarray(x * along[0] + y * along[1] + z * along[2])


def twice_area(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    """Return twice the area of a closed line, positive if it runs counter-clockwise."""
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
