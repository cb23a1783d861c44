"""The contest's tasks, done by SciPy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.spatial import cKDTree

from contest.task import Task

if TYPE_CHECKING:
    import numpy as np

    from contest.clouds import Scales


def radius(points: np.ndarray, scales: Scales) -> Task:
    """Count the neighbours on all cores."""

    def count() -> np.ndarray:
        tree = cKDTree(points)
        return tree.query_ball_point(points, scales.radius_m, return_length=True, workers=-1)

    return Task(count, lambda counts: counts - 1)
