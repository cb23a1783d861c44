from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["__version__", "radius_outlier_mask"]

__version__: Final[str]

def radius_outlier_mask(
    points: NDArray[Any], radius_m: float, min_neighbors: int, threads: int
) -> NDArray[np.bool_]: ...
