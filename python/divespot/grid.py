"""The ground grid: one height per cell, and its integral (paper, "Voxel Meshing Calculation")."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot import _native
from divespot._arguments import as_floats, flags, number
from divespot.errors import DivespotError


@dataclass(frozen=True, eq=False)
class HeightMap:
    """One height per square cell, and the points behind it.

    Attributes
    ----------
    heights_m
        Shape ``(rows, columns)``: height at the middle of each cell, NaN for empty cells.
        x grows along a row, y from row to row.
    counts
        Points in each cell.
    origin_m
        x and y of the corner of cell (0, 0).
    cell_m
        Edge of a cell.

    """

    heights_m: NDArray[np.float64]
    counts: NDArray[np.uint32]
    origin_m: tuple[float, float]
    cell_m: float

    def centers_m(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return x and y of the middle of each cell, each of shape ``(rows, columns)``."""
        rows, columns = np.indices(self.heights_m.shape)
        x0, y0 = self.origin_m
        x = np.asarray(x0 + (columns + 0.5) * self.cell_m)
        return x, np.asarray(y0 + (rows + 0.5) * self.cell_m)


def height_map(
    points: ArrayLike,
    cell_m: float,
    *,
    triangulated: bool = False,
    mask: ArrayLike | None = None,
) -> HeightMap:
    """Average the points of each cell of a square grid in x and y.

    The mean height is carried from the mean position of a cell's points to the cell's middle, along
    the slope between the neighbouring cells. The grid starts a quarter of a cell below the lowest x
    and y, so that the points of a regular raster do not lie on the edges between cells.

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres.
    cell_m
        Edge of a cell.
    triangulated
        Average the linear surface between the points (a triangulated irregular network) instead:
        accurate where points are few or farther apart than cells, and for any density. Empty cells
        get a height too, unless they are outside all points or in a hole that is wide compared
        with the point spacing around it.
    mask
        Shape ``(n,)``: the points to use; the grid covers all points, which must be finite.

    Raises
    ------
    DivespotError
        No points, `points` of wrong shape or type, a cell that is not above 0 or so small that
        the grid has more than 2**26 cells.

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> x, y = np.meshgrid(np.arange(4) * 0.5, np.arange(3) * 0.5)
    >>> points = np.column_stack([x.ravel(), y.ravel(), 2 * x.ravel()])
    >>> divespot.height_map(points, cell_m=1.0).heights_m
    array([[0.5, 2.5],
           [0.5, 2.5]])

    """
    kept = None if mask is None else flags("mask", mask)
    cell = number("cell_m", cell_m)
    raw = _native.height_map(as_floats("points", points), cell, triangulated, kept, 1, own=False)
    return HeightMap(raw.heights_m, raw.counts, raw.origin_m, cell_m)


@dataclass(frozen=True)
class Volume:
    """Volume above (`cut_m3`) and missing below (`fill_m3`) a base, over `area_m2`."""

    cut_m3: float
    fill_m3: float
    area_m2: float

    @property
    def volume_m3(self) -> float:
        """`cut_m3` less `fill_m3`."""
        return self.cut_m3 - self.fill_m3


def integrate(heights_m: ArrayLike, cell_m: float, *, base_m: ArrayLike = 0.0) -> Volume:
    """Sum cell area times height above the base, cut and fill separately.

    Parameters
    ----------
    heights_m
        Heights of the cells, of any shape. Cells with NaN are left out.
    cell_m
        Edge of a cell.
    base_m
        Height of the base: one number, or one per cell.

    Raises
    ------
    DivespotError
        The base's shape differs from that of the heights, or a cell is not above 0.

    Examples
    --------
    >>> import divespot
    >>> volume = divespot.integrate([2.0, 1.0, -1.0], cell_m=0.5)
    >>> volume.cut_m3, volume.fill_m3, volume.volume_m3
    (0.75, 0.25, 0.5)

    """
    heights, base = as_floats("heights_m", heights_m), as_floats("base_m", base_m)
    if not 0.0 < number("cell_m", cell_m) < math.inf:
        raise DivespotError(f"cell_m is {cell_m!r}: a finite number above 0 is needed")
    try:
        above = np.broadcast_to(heights - base, heights.shape)
    except ValueError:
        raise DivespotError(
            f"base_m has shape {base.shape}: one number, or shape {heights.shape}, is needed"
        ) from None
    return Volume(*_native.integrate(above.astype(np.float64).ravel(), cell_m))
