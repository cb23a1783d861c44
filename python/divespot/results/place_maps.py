"""Cells of a comparison: away from where a scan ends, under a thing, and how high points reach."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from divespot.results.pile_matching import labels

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from divespot.grid import HeightMap
    from divespot.level import Level
    from divespot.report import Report

#: So many cells, or points apart, from where a scan ends its surface is of few points.
UNSURE = 2.0

#: Reasons for which what stands there is no bulk material.
THINGS = ("steep sides", "beside a shadow", "floating", "apart from the ground")


def inner(off_m: NDArray[np.float64], grid: HeightMap) -> NDArray[np.bool_]:
    """Return which cells lie away from where a scan ends.

    A cell without points is no end, that of the map is one.
    """
    seen = ~np.isnan(off_m)
    apart = math.sqrt(float(seen.sum()) / max(float(grid.counts[seen].sum()), 1.0))
    steps = math.ceil(UNSURE * max(apart, 1.0))
    around = 2 * steps
    ends = _grown(~_grown(np.pad(seen, around), steps), around)
    return ~ends[around:-around, around:-around]


def _grown(cells: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    """Return cells, and those within so many steps of them."""
    for _ in range(steps):
        around = np.pad(cells, 1)
        cells = around[:-2, 1:-1] | around[2:, 1:-1] | around[1:-1, :-2] | around[1:-1, 2:] | cells
    return cells


def slopes_of(level: Level) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes along x and y of what lies midway between the surveys, 0 if unknown."""
    middle = (level.height_map.heights_m + level.base_m) / 2.0
    along_y, along_x = np.gradient(middle, level.height_map.cell_m)
    return np.asarray(np.nan_to_num(along_x)), np.asarray(np.nan_to_num(along_y))


def things(reports: Iterable[Report | None], level: Level) -> NDArray[np.bool_]:
    """Return where either survey shows what is no bulk material."""
    standing = [
        item
        for report in reports
        if report is not None
        for item in report.other_objects
        if item.reason in THINGS
    ]
    return labels(standing, level.frame, level) > 0


def tops_m(points: NDArray[np.float64], level: Level) -> NDArray[np.float64]:
    """Return the height of the highest point over each cell, on the surface or not."""
    grid = level.height_map
    at = level.frame.to_level(points)
    column, row = np.floor((at[:, :2] - grid.origin_m) / grid.cell_m).astype(np.int64).T
    rows, columns = grid.heights_m.shape
    within = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    tops = np.full(grid.heights_m.shape, -math.inf)
    np.maximum.at(tops, (row[within], column[within]), at[within, 2])
    return np.where(np.isinf(tops), math.nan, tops)
