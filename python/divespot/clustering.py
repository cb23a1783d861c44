"""Clusters of points by density."""

from dataclasses import dataclass
from typing import Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from divespot import _native
from divespot._arguments import as_floats, number, switch, thread_number, whole, word

Method = Literal["eom", "leaf"]


@dataclass(frozen=True, eq=False)
class Clusters:
    """The clusters of `n` points."""

    labels: NDArray[np.int64]
    """Shape ``(n,)``: the cluster of each point, the largest being 0; -1 for noise."""
    probabilities: NDArray[np.float64]
    """Shape ``(n,)``: membership strength of each point in its cluster, 0 (noise) to 1."""
    mst_weights_m: NDArray[np.float64]
    """The weights of the minimum spanning tree's edges in metres, ascending. One less than
    there are finite points."""


@overload
def hdbscan(
    points: ArrayLike,
    *,
    min_cluster_size: int = 5,
    min_samples: int | None = None,
    cluster_selection_epsilon: float = 0.0,
    cluster_selection_method: Method = "eom",
    allow_single_cluster: bool = False,
    threads: int = 0,
    details: Literal[False] = False,
) -> NDArray[np.int64]: ...
@overload
def hdbscan(
    points: ArrayLike,
    *,
    min_cluster_size: int = 5,
    min_samples: int | None = None,
    cluster_selection_epsilon: float = 0.0,
    cluster_selection_method: Method = "eom",
    allow_single_cluster: bool = False,
    threads: int = 0,
    details: Literal[True],
) -> Clusters: ...
def hdbscan(  # noqa: PLR0913 - the keywords of the package of that name
    points: ArrayLike,
    *,
    min_cluster_size: int = 5,
    min_samples: int | None = None,
    cluster_selection_epsilon: float = 0.0,
    cluster_selection_method: Method = "eom",
    allow_single_cluster: bool = False,
    threads: int = 0,
    details: bool = False,
) -> NDArray[np.int64] | Clusters:
    """Cluster points by density: exact HDBSCAN (paper, Algorithm 1, line 18).

    The parameters mean the same as in the Python package ``hdbscan``. The result is the same bit
    for bit at any number of threads, and the same for each point in any order of the points.
    Clusters are numbered by size, those of equal size by their first point in the order of x,
    y, z. Ctrl-C ends a long run.

    Edges of equal weight are merged at once. If such a merge joins several clusters, the single
    points in it belong to none of them; the package assigns them to one cluster, which depends on
    the order of the points.

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres.
    min_cluster_size
        Points that make a cluster, 2 or more. If there are fewer points in all, all are noise.
    min_samples
        The k of the core distance, the distance to the k-th nearest neighbour, 1 or more; the
        point itself does not count. `min_cluster_size` if not given.
    cluster_selection_epsilon
        Distance in metres below which clusters are not split (Malzer and Baum 2019).
    cluster_selection_method
        ``"eom"`` selects clusters that persist longer than their children (excess of mass),
        ``"leaf"`` those that are not split further.
    allow_single_cluster
        Whether all points may be one cluster.
    threads
        Number of threads; 0: every core available to the process.
    details
        Return a `Clusters` instead of the labels alone.

    Returns
    -------
    labels
        Shape ``(n,)``: the cluster of each point, -1 for noise and where a coordinate is not
        finite.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, or a setting is out of range.

    References
    ----------
    Campello, Moulavi, Sander: Density-based clustering based on hierarchical density
    estimates. PAKDD 2013.

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> row = np.column_stack([np.arange(10) * 0.01, np.zeros(10), np.zeros(10)])
    >>> points = np.concatenate([row, row + [0, 1, 0], [[9, 9, 9]]])  # two rows and a stray
    >>> divespot.hdbscan(points, min_cluster_size=5, min_samples=3)
    array([ 0,  0,  0,  0,  0,  0,  0,  0,  0,  0,  1,  1,  1,  1,  1,  1,  1,
            1,  1,  1, -1])

    """
    labels, probabilities, mst_weights_m = _native.hdbscan(
        as_floats("points", points),
        whole("min_cluster_size", min_cluster_size),
        whole("min_samples", min_cluster_size if min_samples is None else min_samples),
        number("cluster_selection_epsilon", cluster_selection_epsilon),
        word("cluster_selection_method", cluster_selection_method),
        switch("allow_single_cluster", allow_single_cluster),
        thread_number(threads),
    )
    return Clusters(labels, probabilities, mst_weights_m) if switch("details", details) else labels
