from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["__version__", "radius_outlier_mask", "voxel_downsample"]

__version__: Final[str]

def radius_outlier_mask(
    points: NDArray[Any], radius_m: float, min_neighbors: int, threads: int
) -> NDArray[np.bool_]: ...
def voxel_downsample(
    points: NDArray[Any], voxel_m: float, threads: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
