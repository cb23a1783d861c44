from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "RawHeightMap",
    "RawObject",
    "__version__",
    "align_to_rectangle",
    "find_ground",
    "fit_plane",
    "ground_height",
    "hdbscan",
    "height_histogram",
    "height_map",
    "integrate",
    "measure_objects",
    "radius_outlier_mask",
    "rotate",
    "rotation_to_z",
    "survey",
    "voxel_downsample",
]

Position = tuple[float, float, float]
Cone = tuple[Position, float]
PlaneParts = tuple[Position, float, int, float]

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
def survey(
    points: NDArray[Any], seed: int, threads: int
) -> tuple[float, float, NDArray[np.float64], NDArray[np.float64]]: ...
def fit_plane(
    points: NDArray[Any],
    threshold_m: float,
    hypotheses: int,
    cone: Cone | None,
    seed: int,
    threads: int,
) -> PlaneParts: ...
def find_ground(
    points: NDArray[Any],
    at: NDArray[np.float64],
    normals: NDArray[np.float64],
    threshold_m: float,
    hypotheses: int,
    cone: Cone | None,
    seed: int,
    threads: int,
) -> PlaneParts: ...
def rotation_to_z(normal: Position) -> NDArray[np.float64]: ...
def align_to_rectangle(points: NDArray[Any]) -> NDArray[np.float64]: ...
def rotate(
    points: NDArray[Any], rotation: list[list[float]], threads: int
) -> NDArray[np.float64]: ...
@final
class RawHeightMap:
    heights_m: NDArray[np.float64]
    counts: NDArray[np.uint32]
    relief_m: NDArray[np.float64]
    origin_m: tuple[float, float]

def height_map(points: NDArray[Any], cell_m: float) -> RawHeightMap: ...
def integrate(
    heights_above_base_m: NDArray[np.float64], cell_m: float
) -> tuple[float, float, float]: ...
@final
class RawObject:
    label: int
    cut_m3: float
    fill_m3: float
    footprint_m2: float
    max_height_m: float
    centroid_m: Position
    outline_m: list[Position]
    seen_fraction: float
    touches_edge: bool
    base: str
    reason: str | None
    u_m3: float
    noise_m3: float
    base_m3: float
    footprint_m3: float
    filled_m3: float
    grid_m3: float

def measure_objects(
    heights_m: NDArray[np.float64],
    origin_m: tuple[float, float],
    cell_m: float,
    labels: NDArray[np.int32],
    toe_cells: int,
    ring_share: float,
    margin_m: float,
    ground: tuple[float, float, float],
    local: bool,
) -> list[RawObject]: ...
