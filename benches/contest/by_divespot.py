"""The contest's tasks, done by divespot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import divespot
from contest.task import HYPOTHESES, MIN_CLUSTER_SIZE, MIN_NEIGHBORS, MIN_SAMPLES, Task

if TYPE_CHECKING:
    import numpy as np

    from contest.clouds import Scales


def radius(points: np.ndarray, scales: Scales) -> Task:
    """Filter strays."""
    return Task(
        lambda: divespot.radius_outlier_mask(points, scales.radius_m, MIN_NEIGHBORS),
        lambda mask: mask,
    )


def hdbscan(points: np.ndarray, scales: Scales) -> Task:  # noqa: ARG001 - as every task
    """Cluster."""
    return clustering(points, MIN_SAMPLES)


def hdbscan_50(points: np.ndarray, scales: Scales) -> Task:  # noqa: ARG001 - as every task
    """Cluster by the 50th neighbour."""
    return clustering(points, 50)


def clustering(points: np.ndarray, min_samples: int) -> Task:
    """Cluster."""
    return Task(
        lambda: divespot.hdbscan(
            points, min_cluster_size=MIN_CLUSTER_SIZE, min_samples=min_samples
        ),
        lambda labels: labels,
    )


def voxel(points: np.ndarray, scales: Scales) -> Task:
    """Thin out."""
    return Task(lambda: divespot.voxel_downsample(points, scales.voxel_m), lambda means: means)


def plane(points: np.ndarray, scales: Scales) -> Task:
    """Find the largest plane."""
    return Task(
        lambda: divespot.fit_plane(points, scales.threshold_m, hypotheses=HYPOTHESES),
        lambda found: (*found.normal, -found.offset_m),
    )


def pipeline(points: np.ndarray, scales: Scales) -> Task:  # noqa: ARG001 - as every task
    """Measure, with nothing set."""
    return Task(lambda: divespot.measure(points), largest_pile_m3)


def largest_pile_m3(report: divespot.Report) -> float:
    """Return what the rival measures too."""
    return max((pile.volume_m3 for pile in report.piles), default=math.nan)


def paper_pipeline(points: np.ndarray, scales: Scales) -> Task:  # noqa: ARG001 - as every task
    """Measure by the paper's method, which clusters the whole scene."""
    settings = divespot.Settings.paper()
    return Task(lambda: divespot.measure(points, settings), largest_pile_m3)
