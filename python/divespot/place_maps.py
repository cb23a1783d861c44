"""Maps for comparing two surveys: outlines, ends of a scan, slopes, highest points."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from divespot.grid import HeightMap

#: Distance from the end of a scan, in cells or points, within which its surface has few points.
UNSURE = 2.0


def numbered(
    lines: Iterable[tuple[int, NDArray[np.float64]]], grid: HeightMap
) -> NDArray[np.int64]:
    """Return the number of the outline around each cell, 0 for none; x and y are the grid's."""
    x, y = grid.centers_m()
    at = np.stack([x.ravel(), y.ravel()], axis=-1)
    found = np.zeros(len(at), dtype=np.int64)
    for number, line in lines:
        near = np.flatnonzero(((at >= line.min(axis=0)) & (at <= line.max(axis=0))).all(axis=1))
        found[near[_native.inside([line], at[near])]] = number
    return found.reshape(x.shape)


def inner(off_m: NDArray[np.float64], grid: HeightMap) -> NDArray[np.bool_]:
    """Return which cells are away from the end of a scan.

    A single cell without points is not an end of the scan; the edge of the map is.
    """
    seen = ~np.isnan(off_m)
    apart = math.sqrt(float(seen.sum()) / max(float(grid.counts[seen].sum()), 1.0))
    steps = math.ceil(UNSURE * max(apart, 1.0))
    around = 2 * steps
    ends = _grown(~_grown(np.pad(seen, around), steps), around)
    return ~ends[around:-around, around:-around]


def _grown(cells: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    """Return the given cells, and those within `steps` of them."""
    for _ in range(steps):
        around = np.pad(cells, 1)
        cells = around[:-2, 1:-1] | around[2:, 1:-1] | around[1:-1, :-2] | around[1:-1, 2:] | cells
    return cells


def slopes_of(
    one_m: NDArray[np.float64], other_m: NDArray[np.float64], cell_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes along x and y of the mean of two surfaces, 0 if unknown."""
    along_y, along_x = np.gradient((one_m + other_m) / 2.0, cell_m)
    return np.asarray(np.nan_to_num(along_x)), np.asarray(np.nan_to_num(along_y))


def tops_m(grid: HeightMap, loose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the height of the highest point over each cell, on the surface or `loose`."""
    column, row = np.floor((loose[:, :2] - grid.origin_m) / grid.cell_m).astype(np.int64).T
    rows, columns = grid.heights_m.shape
    within = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    tops = np.where(grid.counts > 0, grid.heights_m, np.nan)
    np.fmax.at(tops, (row[within], column[within]), loose[within, 2])
    return tops
