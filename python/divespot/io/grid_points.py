"""The cells of a georeferenced grid as points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from divespot.io.scan import FloatArray


def points_of_grid(
    heights: FloatArray,
    affine: tuple[float, float, float, float, float, float],
    first: tuple[int, int] = (0, 0),
) -> FloatArray:
    """Return x, y, z of the centre of each cell, row by row.

    `affine` is a, b, c, d, e, f of ``x = a column + b row + c``, ``y = d column + e row + f``,
    where integers are the corners of cells; `first` is the column and row of the first cell.

    Raises
    ------
    DivespotError
        The transform gives cells no area.

    """
    a, b, c, d, e, f = affine
    if not np.isfinite(affine).all() or a * e == b * d:
        raise DivespotError("its cells have no area: their size and place are needed")
    column = np.arange(first[0], first[0] + heights.shape[1]) + 0.5
    row = np.arange(first[1], first[1] + heights.shape[0])[:, None] + 0.5
    xyz = np.empty((*heights.shape, 3))
    xyz[..., 0] = a * column + b * row + c
    xyz[..., 1] = d * column + e * row + f
    xyz[..., 2] = heights
    return xyz.reshape(-1, 3)
