"""The contest's tasks, done by the `hdbscan` package."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hdbscan import HDBSCAN
from joblib.externals.loky import get_reusable_executor

from contest.task import MIN_CLUSTER_SIZE, MIN_SAMPLES, Task

if TYPE_CHECKING:
    import numpy as np

    from contest.clouds import Scales


def hdbscan(points: np.ndarray, scales: Scales) -> Task:  # noqa: ARG001 - as every task
    """Cluster exactly, on all cores; by default the package approximates."""
    model = HDBSCAN(
        min_cluster_size=MIN_CLUSTER_SIZE,
        min_samples=MIN_SAMPLES,
        approx_min_span_tree=False,
        core_dist_n_jobs=-1,
    )
    return Task(lambda: model.fit_predict(points), at_the_end)


def at_the_end(result: Any) -> Any:  # noqa: ANN401 - passed on as it is
    """End the processes that joblib keeps for a next time, or it waits five minutes for one."""
    get_reusable_executor(reuse=True).shutdown()
    return result
