"""The kernels: NumPy arrays in, NumPy arrays out, each worth importing alone.

Points are arrays of shape ``(n, 3)``, x, y, z in metres, float32 or float64, of any strides;
anything that NumPy turns into such an array will do. Rows that are not finite are left out.
The same points give the same bits, in any order and at any number of threads. The interpreter
is free while a kernel runs. Bad input raises `divespot.errors.DivespotError`.
"""

from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot import _native
from divespot._arguments import as_floats, number, whole


def radius_outlier_mask(
    points: ArrayLike, radius_m: float, min_neighbors: int, *, threads: int = 0
) -> NDArray[np.bool_]:
    """Tell which points have company: the radius filter of the paper's Algorithm 1.

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres.
    radius_m
        A neighbour lies no further away than this.
    min_neighbors
        Neighbours that a point needs. The point itself does not count; a duplicate of it does.
    threads
        0 takes every core that the process may use.

    Returns
    -------
    mask
        Shape ``(n,)``: true where at least `min_neighbors` others lie within the radius. False
        where a coordinate is not finite.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, or a setting is out of range.

    """
    return _native.radius_outlier_mask(
        as_floats("points", points),
        number("radius_m", radius_m),
        whole("min_neighbors", min_neighbors),
        whole("threads", threads),
    )


@overload
def voxel_downsample(
    points: ArrayLike, voxel_m: float, *, return_counts: Literal[False] = False, threads: int = 0
) -> NDArray[np.float64]: ...
@overload
def voxel_downsample(
    points: ArrayLike, voxel_m: float, *, return_counts: Literal[True], threads: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
def voxel_downsample(
    points: ArrayLike, voxel_m: float, *, return_counts: bool = False, threads: int = 0
) -> NDArray[np.float64] | tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Replace the points in each cube of a grid by their mean (paper, Pre-process 3).

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres.
    voxel_m
        Edge of a cube. The first one starts 0.38 of an edge below the lowest corner of the
        points, so that a regular grid of points does not lie on the faces of the cubes.
    return_counts
        Return the number of points in each cube as well.
    threads
        0 takes every core that the process may use.

    Returns
    -------
    means
        Shape ``(m, 3)``, one row an occupied cube, sorted by z, then y, then x of the cubes.
    counts
        Shape ``(m,)``, only with `return_counts`.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, a setting is out of range, or the extent of the
        points divided by `voxel_m` is beyond the precision of a float.

    """
    means, counts = _native.voxel_downsample(
        as_floats("points", points), number("voxel_m", voxel_m), whole("threads", threads)
    )
    return (means, counts) if return_counts else means
