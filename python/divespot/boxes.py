"""Boxes in plan, along the axes of whatever frame their places are in."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

    #: The lowest x and y, and the highest.
    Box: TypeAlias = tuple[float, float, float, float]


def box_of(places: ArrayLike) -> Box:
    """Return the box around places in plan, shape ``(n, 2 or 3)``."""
    plan = np.asarray(places, dtype=np.float64)[:, :2]
    (x0, y0), (x1, y1) = plan.min(axis=0).tolist(), plan.max(axis=0).tolist()
    return x0, y0, x1, y1


def grown(box: Box, by: float) -> Box:
    """Return a box that reaches farther on all sides."""
    x0, y0, x1, y1 = box
    return x0 - by, y0 - by, x1 + by, y1 + by


def joined(boxes: Iterable[Box]) -> Box:
    """Return the box around boxes."""
    return box_of([corner for x0, y0, x1, y1 in boxes for corner in ((x0, y0), (x1, y1))])


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share a place."""
    along_x = one[0] <= other[2] and other[0] <= one[2]
    return along_x and one[1] <= other[3] and other[1] <= one[3]


def longer(box: Box) -> float:
    """Return the longer side of a box."""
    return max(box[2] - box[0], box[3] - box[1])
