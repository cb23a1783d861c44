"""The space between a pile's surface and its base."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot._arguments import require_kind
from divespot.report import Report

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from divespot.directions import Position
    from divespot.grid import HeightMap


@dataclass(frozen=True, eq=False)
class Body:
    """The seen cells of a pile.

    Attributes
    ----------
    points_m
        Shape ``(n, 3)``: x and y of the middle of each seen cell inside the outline, and its
        height above the base.
    outline_m
        Shape ``(k, 2)``: corners of the outline in plan.
    cell_m
        Edge of a cell.

    """

    points_m: NDArray[np.float64]
    outline_m: NDArray[np.float64]
    cell_m: float


def bodies_of(report: Report) -> tuple[Body, ...]:
    """Return the bodies of a report's piles, in its order.

    Examples
    --------
    >>> import divespot
    >>> from divespot import simulate
    >>> from divespot.volume import bodies_of
    >>> report = divespot.measure(simulate.scan("shape-05", density=0.03).points)
    >>> [body.points_m.shape[1] for body in bodies_of(report)]
    [3]

    """
    require_kind("report", report, Report)
    level = report.level
    piles = (outline.corners_m for outline in level.outlines if outline.reason is None)
    return tuple(body(level.height_map, level.base_m, corners) for corners in piles)


def body(grid: HeightMap, base_m: NDArray[np.float64], corners_m: Sequence[Position]) -> Body:
    """Return the cells of a height map inside an outline, given in the level frame."""
    outline = np.array(corners_m, dtype=np.float64).reshape(-1, 3)[:, :2]
    x, y = grid.centers_m()
    places = np.stack([x, y, grid.heights_m - base_m], axis=-1).reshape(-1, 3)
    places = places[~np.isnan(places[:, 2])]
    return Body(places[inside(places[:, :2], outline)], outline, grid.cell_m)


def inside(places_m: NDArray[np.float64], outline_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which places in plan, shape ``(n, 2)``, are inside an outline (even-odd rule)."""
    within = np.zeros(len(places_m), dtype=np.bool_)
    x, y = places_m.T
    for (x0, y0), (x1, y1) in zip(outline_m, np.roll(outline_m, -1, axis=0), strict=True):
        if y0 != y1:
            crosses = (y0 <= y) != (y1 <= y)
            within ^= crosses & (x < x0 + (y - y0) * ((x1 - x0) / (y1 - y0)))
    return within
