"""The contest's tasks, done by Open3D."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from contest.libusb import preload
from contest.task import ANCHOR, HYPOTHESES, MIN_NEIGHBORS, Task

preload()
import open3d as o3d  # noqa: E402 - needs libusb

if TYPE_CHECKING:
    from contest.clouds import Scales


def loaded(points: np.ndarray) -> o3d.geometry.PointCloud:
    """Copy points into Open3D's own structure."""
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def radius(points: np.ndarray, scales: Scales) -> Task:
    """Filter strays. More than `nb_points` are asked for, the point itself among them."""
    cloud = loaded(points)

    def mask(found: tuple[object, list[int]]) -> np.ndarray:
        kept = np.zeros(len(points), dtype=bool)
        kept[found[1]] = True
        return kept

    return Task(lambda: cloud.remove_radius_outlier(MIN_NEIGHBORS, scales.radius_m), mask)


def voxel(points: np.ndarray, scales: Scales) -> Task:
    """Thin out; the answer is that for cubes where divespot has them."""
    cloud = loaded(points)
    corner = points.min(axis=0) - ANCHOR * scales.voxel_m

    def same_cubes(_: object) -> np.ndarray:
        far = points.max(axis=0) + scales.voxel_m
        means, _, _ = cloud.voxel_down_sample_and_trace(scales.voxel_m, corner, far)
        return np.asarray(means.points)

    return Task(lambda: cloud.voxel_down_sample(scales.voxel_m), same_cubes)


def plane(points: np.ndarray, scales: Scales) -> Task:
    """Find the largest plane; a probability of 1 keeps it from stopping early."""
    return segmentation(points, scales, probability=1.0)


def plane_early_exit(points: np.ndarray, scales: Scales) -> Task:
    """Find the largest plane as its users do: it stops when it is sure enough."""
    return segmentation(points, scales, probability=0.99999999)


def segmentation(points: np.ndarray, scales: Scales, probability: float) -> Task:
    """Find the largest plane."""
    cloud = loaded(points)
    return Task(
        lambda: cloud.segment_plane(scales.threshold_m, 3, HYPOTHESES, probability),
        lambda found: tuple(found[0]),
    )
