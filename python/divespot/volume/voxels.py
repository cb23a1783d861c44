"""The volume of the voxels inside a pile."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError
from divespot.volume.geometry import MOST, checked, positive

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def inner_voxels(points_m: ArrayLike, voxel_m: float) -> float:
    """Count the voxels of a 3D grid whose centre is between the surface and the base.

    Source: the method of inner voxels that the paper's ground grid replaces ("Voxel Meshing
    Calculation"). Known weaknesses: every voxel of the box around the pile is held, so that memory
    grows with the cube of its size; a voxel counts in full or not at all; a column without
    a point counts nothing, so that the edge cannot be finer than the point spacing.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.
    voxel_m
        Edge of a voxel.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, or `voxel_m` is not above 0 or gives
        more than 2**32 voxels.

    Examples
    --------
    >>> import numpy as np
    >>> from divespot.volume import inner_voxels
    >>> x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)))
    >>> z = 1 - np.hypot(x, y) / 20  # a cone 1 m high, 2 m wide: 1.047 m3
    >>> points = np.column_stack([x / 20, y / 20, z])[z >= 0]
    >>> round(inner_voxels(points, 0.05), 2)
    1.05

    """
    points = checked(points_m)
    extent_m = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    edge_m = positive("voxel_m", voxel_m, extent_m)
    heights = _columns(points, edge_m)
    layers = int(heights.max(initial=0.0) / edge_m) + 1
    _check(heights.size * layers, edge_m)
    middles = (np.arange(layers) + 0.5) * edge_m
    inside = np.count_nonzero(middles < heights[:, :, None])
    return float(inside) * edge_m**3 if inside else 0.0


def _check(voxels: int, voxel_m: float) -> None:
    if voxels > MOST:
        raise DivespotError(
            f"voxel_m is {voxel_m}: that gives {voxels:,} voxels or more, a larger edge is needed"
        )


def _columns(points_m: NDArray[np.float64], voxel_m: float) -> NDArray[np.float64]:
    """Return the mean height of the points in each column of voxels, 0 where there is none."""
    if not len(points_m):
        return np.zeros((1, 1))
    # The lowest point is in the middle of its column, and so are cells of the same edge.
    low = points_m[:, :2].min(axis=0)
    column = np.floor((points_m[:, :2] - low) / voxel_m + 0.5).astype(np.int64)
    rows, columns = column.max(axis=0) + 1
    _check(int(rows) * int(columns), voxel_m)
    flat = column[:, 0] * columns + column[:, 1]
    count = np.bincount(flat, minlength=rows * columns)
    total = np.bincount(flat, points_m[:, 2], minlength=rows * columns)
    return np.asarray(total / np.maximum(count, 1)).reshape(rows, columns)
