"""The kernels: NumPy arrays in, NumPy arrays out, each usable on its own.

Points are arrays of shape ``(n, 3)``, x, y, z in metres, float32 or float64, of any strides, or
anything that NumPy converts to such an array. Rows that are not finite are left out. The same
points give the same bits, in any order and at any number of threads. Kernels release the GIL. Bad
input raises `divespot.errors.DivespotError`.
"""

from dataclasses import dataclass
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot import _native
from divespot._arguments import as_floats, number, switch, thread_number, whole, word


def radius_outlier_mask(
    points: ArrayLike, radius_m: float, min_neighbors: int, *, threads: int = 0
) -> NDArray[np.bool_]:
    """Return which points have enough neighbours: the radius filter of the paper's Algorithm 1.

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres.
    radius_m
        Largest distance of a neighbour, in metres.
    min_neighbors
        Neighbours that a point needs. The point itself does not count; a duplicate of it does.
    threads
        Number of threads; 0: every core available to the process.

    Returns
    -------
    mask
        Shape ``(n,)``: true where at least `min_neighbors` other points are within the radius.
        False where a coordinate is not finite.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, or a setting is out of range.

    Examples
    --------
    >>> import divespot
    >>> points = [[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [1, 1, 1]]
    >>> divespot.radius_outlier_mask(points, radius_m=0.05, min_neighbors=2)
    array([ True,  True,  True, False])

    """
    return _native.radius_outlier_mask(
        as_floats("points", points),
        number("radius_m", radius_m),
        whole("min_neighbors", min_neighbors),
        thread_number(threads),
        own=False,
        by_position=False,
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
        Edge of a cube, in metres. The first one starts 0.38 of an edge below the lowest corner of
        the points, so that points on a regular grid do not lie on the faces of the cubes.
    return_counts
        Also return the number of points in each cube.
    threads
        Number of threads; 0: every core available to the process.

    Returns
    -------
    means
        Shape ``(m, 3)``, one row per occupied cube, sorted by z, then y, then x of the cubes.
    counts
        Shape ``(m,)``, only with `return_counts`.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, a setting is out of range, or the extent of the
        points divided by `voxel_m` is beyond the precision of a float.

    Examples
    --------
    >>> import divespot
    >>> points = [[0, 0, 0], [0.25, 0, 0], [5, 0, 0]]
    >>> divespot.voxel_downsample(points, voxel_m=1.0, return_counts=True)
    (array([[0.125, 0.   , 0.   ],
           [5.   , 0.   , 0.   ]]), array([2, 1], dtype=uint32))

    """
    means, counts = _native.voxel_downsample(
        as_floats("points", points), number("voxel_m", voxel_m), thread_number(threads)
    )
    return (means, counts) if switch("return_counts", return_counts) else means


@dataclass(frozen=True, eq=False)
class HeightHistogram:
    """A histogram of heights, with bins from low to high.

    Attributes
    ----------
    centers_m
        Shape ``(bins,)``: the middle height of each bin, in metres.
    counts
        Shape ``(bins,)``: the number of heights in each bin.
    smoothed
        Shape ``(bins,)``: the mean count in the window around each bin.

    """

    centers_m: NDArray[np.float64]
    counts: NDArray[np.uint32]
    smoothed: NDArray[np.float64]


def height_histogram(heights_m: ArrayLike, *, bin_m: float, window: int = 5) -> HeightHistogram:
    """Count heights in bins and smooth the counts (paper, Algorithm 3).

    The paper's window sums one bin more than it divides by, and shifts the result by half a
    window. Here the smoothed count of a bin is the mean over the bins around it; at the ends, over
    those that exist.

    Parameters
    ----------
    heights_m
        Shape ``(n,)``, in metres. Values that are not finite are left out.
    bin_m
        Height of a bin, in metres. The first one starts 0.38 of it below the lowest height, so
        that heights at multiples of a fraction of the bin do not lie on the edges of bins.
    window
        Bins to average over: an odd number.

    Raises
    ------
    DivespotError
        `heights_m` have the wrong shape or type or no finite value, a setting is out of range, or
        there would be more than 2**24 bins.

    Examples
    --------
    >>> import divespot
    >>> divespot.height_histogram([0.0, 0.0, 0.0, 1.0], bin_m=1.0, window=1).counts
    array([3, 1], dtype=uint32)

    """
    return HeightHistogram(
        *_native.height_histogram(
            as_floats("heights_m", heights_m), number("bin_m", bin_m), whole("window", window)
        )
    )


def ground_height(
    heights_m: ArrayLike,
    *,
    bin_m: float,
    window: int = 5,
    rule: Literal["first", "lower", "midpoint"] = "lower",
    lower_fraction: float = 0.5,
) -> float:
    """Find the height of the ground: a peak of the height histogram (paper, Algorithm 3).

    The result is finer than a bin: it is the mean of the heights in the window around the peak.

    Parameters
    ----------
    heights_m
        Shape ``(n,)``, in metres. Values that are not finite are left out.
    bin_m, window
        As in `height_histogram`.
    rule
        ``"first"``: the lowest peak that reaches a tenth of the highest and then falls to half of
        its own height. ``"lower"``: the highest peak in the lower part. ``"midpoint"``: midway
        between the lowest and the highest peak in the lower part that reach half of the highest
        one there, for a floor that registration split into several levels (paper, "When the
        ground becomes uneven").
    lower_fraction
        The lower part is this share of the range from the 1st to the 99th percentile of the
        heights, which a single outlier does not change. A peak at the upper end of the lower part
        is followed upward to its top.

    Raises
    ------
    DivespotError
        As `height_histogram`; `rule` or `lower_fraction` is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> heights_m = np.concatenate([np.full(100, 0.25), np.linspace(0.3, 0.4, 10)])
    >>> divespot.ground_height(heights_m, bin_m=0.01)
    0.25

    """
    return _native.ground_height(
        as_floats("heights_m", heights_m),
        number("bin_m", bin_m),
        whole("window", window),
        word("rule", rule),
        number("lower_fraction", lower_fraction),
    )
