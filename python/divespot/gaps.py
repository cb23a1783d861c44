"""Scenes in parts that are far apart: the empty bands between the parts are closed up.

Memory and time of a grid are proportional to the area of its box, not to the area seen. Bands
across the scene that hold no point and are wider than the widest part are narrowed to that width,
by moving the parts towards each other by whole cells. Nothing in a part depends on anything
farther away than the part is wide, so results do not change. Positions are moved back when they
are converted to the scan's frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from divespot.settings import given

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.grid import HeightMap
    from divespot.settings import Settings

#: Grids of at most this many cells, or this many per point, cost little and stay as they are. A
#: surface has a quarter of a cell per point.
FEW_CELLS = 2**18
CELLS_A_POINT = 4.0

#: Least width of an empty band in cells, and least mean number of points per part. With cells far
#: smaller than the point spacing, most cells are empty, which does not separate parts.
NARROWEST = 64
FEWEST_POINTS = 100

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True, eq=False)
class Gaps:
    """The empty bands of a level frame that were closed up.

    Attributes
    ----------
    at_m
        For x and y: the middle of what is left of each band, ascending.
    moved_m
        For x and y: by how much the parts before, between and after these bands were moved.

    """

    at_m: tuple[NDArray[np.float64], NDArray[np.float64]]
    moved_m: tuple[NDArray[np.float64], NDArray[np.float64]]

    @property
    def is_none(self) -> bool:
        """Whether there are no such bands."""
        return not any(len(at) for at in self.at_m)

    def opened(self, places_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return positions, shape ``(..., 3)``, in the level frame as it was before closing."""
        if self.is_none:
            return places_m
        there = np.array(places_m, dtype=np.float64)
        for axis in range(2):
            there[..., axis] += self._moved(there[..., axis], axis)
        return there

    def opened_map(self, grid: HeightMap) -> HeightMap:
        """Return a height map that includes the bands again, with unseen cells."""
        if self.is_none:
            return grid
        heights_m = self.opened_cells(grid.heights_m, grid, np.nan)
        return replace(grid, heights_m=heights_m, counts=self.opened_cells(grid.counts, grid, 0))

    def opened_cells(
        self, values: NDArray[Scalar], grid: HeightMap, unseen: float
    ) -> NDArray[Scalar]:
        """Return values of a map's cells, with a fill value for cells of the bands."""
        if self.is_none:
            return values
        columns, rows = (self._cells(axis, values.shape[1 - axis], grid) for axis in range(2))
        opened: NDArray[Scalar] = np.full_like(
            values, unseen, shape=(rows[-1] + 1, columns[-1] + 1)
        )
        opened[np.ix_(rows, columns)] = values
        return opened

    def _cells(self, axis: int, count: int, grid: HeightMap) -> NDArray[np.intp]:
        """Return for each column or row its number in the map that includes the bands."""
        cells = np.arange(count)
        middles_m = np.asarray(grid.origin_m[axis] + (cells + 0.5) * grid.cell_m, np.float64)
        return cells + np.rint(self._moved(middles_m, axis) / grid.cell_m).astype(np.intp)

    def _moved(self, places_m: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
        return self.moved_m[axis][np.searchsorted(self.at_m[axis], places_m)]


NO_GAPS = Gaps((np.empty(0), np.empty(0)), (np.zeros(1), np.zeros(1)))


def close_gaps(points: NDArray[np.float64], settings: Settings) -> tuple[NDArray[np.float64], Gaps]:
    """Close up the empty bands of levelled points along x and y.

    If an outline or another surface in the level frame is used, nothing is changed.
    """
    own = settings.base == "local" and not settings.compare_bases and not settings.is_outlined
    cell_m = given(settings.cell_m)
    if not own or not _is_sparse(points, cell_m):
        return points, NO_GAPS
    found = [_gaps(np.sort(points[:, axis]), cell_m) for axis in range(2)]
    for axis, (first_m, _, moved_m) in enumerate(found):
        points[:, axis] -= moved_m[np.searchsorted(first_m, points[:, axis], side="right")]
    (_, x_m, by_x_m), (_, y_m, by_y_m) = found
    return points, Gaps((x_m, y_m), (by_x_m, by_y_m))


def _is_sparse(points: NDArray[np.float64], cell_m: float) -> bool:
    width_m, depth_m = (float(np.ptp(points[:, axis])) for axis in range(2))
    cells = (width_m / cell_m) * (depth_m / cell_m)
    # If the number of cells is infinite, making the grid raises the error.
    return max(FEW_CELLS, CELLS_A_POINT * len(points)) < cells < math.inf


def _gaps(
    sorted_m: NDArray[np.float64], cell_m: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return where further parts begin, the middles of the remaining bands, and the moves."""
    apart_m = np.diff(sorted_m)
    between = np.flatnonzero(apart_m > NARROWEST * cell_m)
    if len(between) * FEWEST_POINTS > len(sorted_m):
        between = between[:0]
    firsts_m = np.append(sorted_m[:1], sorted_m[between + 1])
    lasts_m = np.append(sorted_m[between], sorted_m[-1:])
    widest_m = max(float((lasts_m - firsts_m).max()), NARROWEST * cell_m)
    closed = between[apart_m[between] >= widest_m + cell_m]
    by_m = np.floor((apart_m[closed] - widest_m) / cell_m) * cell_m
    moved_m = np.concatenate([[0.0], np.cumsum(by_m)])
    first_m = sorted_m[closed + 1]
    left_m = apart_m[closed] - by_m
    return first_m, first_m - moved_m[1:] - 0.5 * left_m, moved_m
