"""Slow reference implementations of the kernels: their definitions in NumPy."""

from collections import defaultdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ANCHOR = (3 - 5**0.5) / 2


def local(points: NDArray[Any]) -> Floats:
    """Return the finite points, relative to their lowest corner."""
    finite: Floats = points[np.isfinite(points).all(axis=1)].astype(np.float64)
    return finite - finite.min(axis=0, initial=np.inf) if len(finite) else finite


def squares(points: Floats) -> Floats:
    """Return all squared distances."""
    x, y, z = (points[:, k, None] - points[:, k] for k in range(3))
    distances: Floats = x * x + y * y + z * z
    return distances


def neighbors(points: NDArray[Any], radius_m: float) -> NDArray[np.int64]:
    """Count the other points within the radius; -1 where a row is not finite."""
    counts = np.full(len(points), -1)
    finite = np.isfinite(points).all(axis=1)
    counts[finite] = (squares(local(points)) <= radius_m * radius_m).sum(axis=1) - 1
    return counts


def voxel_downsample(points: NDArray[Any], voxel_m: float) -> tuple[Floats, list[int]]:
    voxels = defaultdict(list)
    for point in local(points):
        x, y, z = np.floor(point / voxel_m + ANCHOR)
        voxels[z, y, x].append(point)
    means = [np.mean(voxels[cell], axis=0) for cell in sorted(voxels)]
    counts = [len(voxels[cell]) for cell in sorted(voxels)]
    return np.array(means).reshape(-1, 3), counts


def point_spacing(points: NDArray[Any]) -> float:
    """Take every position, not a sample."""
    positions = np.unique(local(points), axis=0)
    fourth = np.sqrt(np.sort(squares(positions), axis=1)[:, 4])
    return float(np.sort(fourth)[(len(fourth) - 1) // 2])


def height_histogram(heights: Floats, bin_m: float, window: int) -> tuple[Floats, Floats]:
    heights = heights[np.isfinite(heights)].astype(np.float64)
    bins = np.floor((heights - heights.min()) / bin_m + ANCHOR).astype(int)
    counts = np.bincount(bins).astype(np.float64)
    half = window // 2
    smoothed = [counts[max(i - half, 0) : i + half + 1].mean() for i in range(len(counts))]
    return counts, np.array(smoothed)


def plane(points: Floats) -> tuple[Floats, float, float]:
    """Return normal, offset and root mean square distance of the least-squares plane."""
    middle = points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(points - middle, full_matrices=False)
    normal: Floats = axes[2]
    return normal, float(normal @ middle), float(sizes[2] / np.sqrt(len(points)))


def height_map(points: NDArray[Any], cell_m: float) -> tuple[Floats, NDArray[np.int64]]:
    """Return mean height, not carried to the middle, and count of each cell."""
    near = local(points)
    columns, rows = np.floor(near[:, :2] / cell_m + 0.25).astype(int).T
    shape = (rows.max() + 1, columns.max() + 1)
    means = np.full(shape, np.nan)
    counts = np.zeros(shape, dtype=np.int64)
    for row, column in set(zip(rows.tolist(), columns.tolist(), strict=True)):
        heights = near[(rows == row) & (columns == column), 2]
        means[row, column], counts[row, column] = heights.mean(), len(heights)
    low: Floats = points[np.isfinite(points).all(axis=1)].astype(np.float64).min(axis=0)
    return means + low[2], counts


def integrate(above: Floats, cell_m: float) -> tuple[float, float, float]:
    """Return cut, fill and area, cell by cell."""
    cut = fill = area = 0.0
    for height in above.ravel():
        if height == height:  # noqa: PLR0124 - not so for NaN
            cut, fill = cut + max(height, 0), fill + max(-height, 0)
            area += 1
    return cut * cell_m**2, fill * cell_m**2, area * cell_m**2
