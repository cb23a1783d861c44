"""Outlier removal, main cluster, uniform sampling (paper, Pre-process 2 and 3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot import _native
from divespot.clusters import find_clusters
from divespot.errors import DivespotError
from divespot.kernels import voxel_downsample
from divespot.selection import only_rows, rows_of
from divespot.settings import given

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from divespot.settings import Settings
    from divespot.spacing import Survey


def radius_filter(
    points: NDArray[np.float64], scan: Survey, settings: Settings
) -> NDArray[np.float64]:
    """Drop points with too few neighbours (Algorithm 1, lines 1 to 17), in the same array.

    Points at the same position count once.

    Raises
    ------
    DivespotError
        No point is left.

    """
    radius_m = given(settings.radius_m)
    if radius_m == 0.0:
        return points
    fewest = settings.stages.min_neighbors
    mask = _native.radius_outlier_mask(
        points,
        radius_m,
        fewest,
        settings.threads,
        own=True,
        by_position=scan.positions < len(points),
    )
    kept = only_rows(points, mask)
    if not len(kept):
        raise DivespotError(
            f"no point has {fewest} neighbours within radius_m = {radius_m:.3g}: "
            "a larger radius_m is needed"
        )
    return kept


def scene_cluster(
    points: NDArray[np.float64], settings: Settings, warn: Callable[[str], None]
) -> NDArray[np.float64]:
    """Keep the largest cluster (Algorithm 1, line 18), if `scene_cluster` is set.

    Raises
    ------
    DivespotError
        There is no cluster.

    """
    if not settings.stages.scene_cluster:
        return points
    labels = find_clusters(points, settings.radius_m, settings)
    kept = rows_of(points, labels == 0)
    if not len(kept):
        raise DivespotError("the scene has no cluster: smaller min_cluster_size is needed")
    if len(kept) < 0.9 * len(points):
        share = 1.0 - len(kept) / len(points)
        warn(f"the scene's largest cluster was kept, and {share:.0%} of the points dropped")
    return kept


def voxels(points: NDArray[np.float64], settings: Settings) -> NDArray[np.float64]:
    """Replace the points of each voxel by their mean, for uniform sampling."""
    voxel_m = given(settings.stages.voxel_m)
    if voxel_m == 0.0:
        return points
    return voxel_downsample(points, voxel_m, threads=settings.threads)
