"""The paper's method as one would script it today: Open3D, the `hdbscan` package and NumPy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from hdbscan import HDBSCAN

from contest.by_hdbscan import at_the_end
from contest.by_open3d import loaded
from contest.task import HYPOTHESES, MIN_CLUSTER_SIZE, MIN_NEIGHBORS, MIN_SAMPLES, Task

if TYPE_CHECKING:
    from contest.clouds import Scales

BIN_M = 0.002
MARGIN_M = 0.01


def pipeline(points: np.ndarray, scales: Scales) -> Task:
    """Measure the largest thing on the ground."""
    return Task(lambda: measure(points, scales), at_the_end)


def measure(points: np.ndarray, scales: Scales) -> float:
    """Return the volume of the largest cluster above the ground in cubic metres."""
    points = largest_cluster(without_strays(points, scales.radius_m), scales.radius_m)
    cloud = loaded(points).voxel_down_sample(scales.voxel_m)
    points = levelled(
        np.asarray(cloud.points), cloud.segment_plane(scales.threshold_m, 3, HYPOTHESES)[0]
    )
    ground_m = ground_height(points[:, 2])
    above = points[points[:, 2] > ground_m + MARGIN_M]
    # The voxels are as far apart as they are wide.
    gap_m = 2.3 * scales.voxel_m
    pile = largest_cluster(without_strays(above, gap_m), gap_m)
    return volume(pile, ground_m, 2.0 * scales.voxel_m)


def without_strays(points: np.ndarray, radius_m: float) -> np.ndarray:
    """Keep points with enough neighbours."""
    kept, _ = loaded(points).remove_radius_outlier(MIN_NEIGHBORS, radius_m)
    return np.asarray(kept.points)


def largest_cluster(points: np.ndarray, gap_m: float) -> np.ndarray:
    """Keep the most populous cluster; without a gap given, a clean floor falls to pieces."""
    model = HDBSCAN(
        min_cluster_size=MIN_CLUSTER_SIZE,
        min_samples=MIN_SAMPLES,
        cluster_selection_epsilon=gap_m,
        allow_single_cluster=True,
        core_dist_n_jobs=-1,
    )
    labels = model.fit_predict(points)
    return points[labels == np.bincount(labels[labels >= 0]).argmax()]


def levelled(points: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """Rotate the plane's normal onto z (Rodrigues), the side on which the points lie up."""
    normal = plane[:3] * np.sign(np.mean(points @ plane[:3] + plane[3]))
    x, y, z = normal
    cross = np.array([[0.0, 0.0, -x], [0.0, 0.0, -y], [x, y, 0.0]])
    return points @ (np.eye(3) + cross + cross @ cross / (1.0 + z)).T


def ground_height(heights_m: np.ndarray) -> float:
    """Return the highest peak of the histogram in the lower half."""
    edges = np.arange(heights_m.min(), heights_m.max() + BIN_M, BIN_M)
    counts = np.convolve(np.histogram(heights_m, edges)[0], np.ones(5), mode="same")
    return edges[counts[: len(counts) // 2].argmax()] + BIN_M / 2.0


def volume(points: np.ndarray, ground_m: float, cell_m: float) -> float:
    """Add up cell area times mean height above the ground."""
    cells = np.floor(points[:, :2] / cell_m).astype(int)
    _, which, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    sums = np.bincount(which.ravel(), weights=points[:, 2] - ground_m)
    return float((sums / counts).sum() * cell_m**2)
