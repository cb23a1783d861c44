from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["__version__", "hdbscan", "radius_outlier_mask", "voxel_downsample"]

__version__: Final[str]

def hdbscan(
    points: NDArray[Any],
    min_cluster_size: int,
    min_samples: int,
    cluster_selection_epsilon: float,
    cluster_selection_method: str,
    allow_single_cluster: bool,
    threads: int,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...
def radius_outlier_mask(
    points: NDArray[Any], radius_m: float, min_neighbors: int, threads: int
) -> NDArray[np.bool_]: ...
def voxel_downsample(
    points: NDArray[Any], voxel_m: float, threads: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
