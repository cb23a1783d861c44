"""Clusters of points by HDBSCAN, numbered by size (paper, Algorithm 1, line 18)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.clustering import hdbscan
from divespot.extras import extra

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.settings import Settings


def find_clusters(
    points: NDArray[np.float64], link_m: float | None, settings: Settings
) -> NDArray[np.int32]:
    """Return a label for each of the points, the largest cluster 0, noise -1.

    Points connected with gaps below `link_m` are one cluster, even if it is the only one, since
    scenes with a single object are the normal case.
    """
    if len(points) < settings.stages.min_cluster_size:
        return np.full(len(points), -1, dtype=np.int32)
    cluster = _package if settings.stages.cluster_backend == "hdbscan" else _own
    return cluster(points, link_m or 0.0, settings).astype(np.int32)


def own_clustering(link_m: float | None, settings: Settings) -> tuple[int, int, float] | None:
    """Return the arguments of this package's kernel for `find_clusters`; None for another one."""
    stages = settings.stages
    if stages.cluster_backend == "hdbscan":
        return None
    return stages.min_cluster_size, stages.min_samples, link_m or 0.0


def _own(points: NDArray[np.float64], link_m: float, settings: Settings) -> NDArray[np.int64]:
    return hdbscan(
        points,
        min_cluster_size=settings.stages.min_cluster_size,
        min_samples=settings.stages.min_samples,
        cluster_selection_epsilon=link_m,
        allow_single_cluster=True,
        threads=settings.threads,
    )


def _package(points: NDArray[np.float64], link_m: float, settings: Settings) -> NDArray[np.int64]:
    """Cluster with the `hdbscan` package; clusters numbered by size."""
    model = extra("hdbscan", "hdbscan", "cluster_backend is 'hdbscan'").HDBSCAN(
        min_cluster_size=settings.stages.min_cluster_size,
        min_samples=settings.stages.min_samples,
        cluster_selection_epsilon=link_m,
        allow_single_cluster=True,
        approx_min_span_tree=False,
        core_dist_n_jobs=settings.threads or -1,
    )
    return by_size(model.fit_predict(points))


def by_size(labels: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the same clusters renumbered by size, the largest 0."""
    counts = np.bincount(labels[labels >= 0])
    rank = np.empty(len(counts) + 1, dtype=np.int64)
    rank[np.argsort(-counts, kind="stable")] = np.arange(len(counts))
    rank[-1] = -1
    return np.asarray(rank[labels])
