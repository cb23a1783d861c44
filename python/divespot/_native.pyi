from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "__version__",
    "ground_height",
    "height_histogram",
    "point_spacing",
    "radius_outlier_mask",
    "voxel_downsample",
]

__version__: Final[str]

def radius_outlier_mask(
    points: NDArray[Any], radius_m: float, min_neighbors: int, threads: int
) -> NDArray[np.bool_]: ...
def voxel_downsample(
    points: NDArray[Any], voxel_m: float, threads: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
def point_spacing(points: NDArray[Any], seed: int) -> float: ...
def height_histogram(
    heights_m: NDArray[Any], bin_m: float, window: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]: ...
def ground_height(
    heights_m: NDArray[Any], bin_m: float, window: int, rule: str, lower_fraction: float
) -> float: ...
