"""The contest's tasks, done by the `fast_hdbscan` package."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fast_hdbscan import HDBSCAN

from contest.task import MIN_CLUSTER_SIZE, MIN_SAMPLES, Task

if TYPE_CHECKING:
    import numpy as np

    from contest.clouds import Scales


def hdbscan(points: np.ndarray, scales: Scales) -> Task:  # noqa: ARG001 - as every task
    """Cluster; what it compiles at its first call is compiled before."""
    model = HDBSCAN(min_cluster_size=MIN_CLUSTER_SIZE, min_samples=MIN_SAMPLES)
    model.fit_predict(points[:5000])
    return Task(lambda: model.fit_predict(points), lambda labels: labels)
