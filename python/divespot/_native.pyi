from collections.abc import Sequence
from typing import Any, Final, Literal, TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from divespot.reasons import Reason
from divespot.report import BaseFrom

__all__ = [
    "RawAccumulator",
    "RawBase",
    "RawCamera",
    "RawCutter",
    "RawFusion",
    "RawHeightMap",
    "RawJoint",
    "RawObject",
    "RawPatches",
    "RawStill",
    "RawTracker",
    "__version__",
    "find_ground",
    "first_crossing",
    "fit_plane",
    "ground_height",
    "hdbscan",
    "height_histogram",
    "height_map",
    "hills",
    "inside",
    "integrate",
    "label_components",
    "level",
    "leveling",
    "lzf_decompress",
    "measure_difference",
    "measure_inside",
    "measure_objects",
    "outermost",
    "plane_base",
    "radius_outlier_mask",
    "read_e57",
    "rotation_to_z",
    "seen",
    "share_heap",
    "surface_and_clusters",
    "surface_base",
    "surface_mask",
    "survey",
    "trim_heap",
    "unevenness_of_rays",
    "voxel_downsample",
]

__version__: Final[str]

_UpFrom: TypeAlias = Literal["given", "sensor", "small tilt", "nothing below"]

def hdbscan(
    points: NDArray[Any],
    min_cluster_size: int,
    min_samples: int,
    cluster_selection_epsilon: float,
    cluster_selection_method: str,
    allow_single_cluster: bool,
    threads: int,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]: ...
def lzf_decompress(packed: bytes, size: int) -> NDArray[np.uint8]: ...
def radius_outlier_mask(
    points: NDArray[Any],
    radius_m: float,
    min_neighbors: int,
    threads: int,
    own: bool,
    by_position: bool,
) -> NDArray[np.bool_]: ...
def share_heap() -> None: ...
def trim_heap() -> None: ...
def surface_mask(points: NDArray[Any], threads: int) -> NDArray[np.bool_]: ...

_Voxels: TypeAlias = tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.uint32]]

def surface_and_clusters(
    points: NDArray[Any],
    cell_m: float,
    noise_m: float,
    anywhere: bool,
    voxel_m: float,
    clustering: tuple[int, int, float] | None,
    threads: int,
) -> tuple[NDArray[np.bool_], _Voxels, NDArray[np.int32] | None]: ...

_Hills: TypeAlias = tuple[NDArray[np.int32], NDArray[np.bool_], NDArray[np.float64], float]

def hills(
    heights_m: NDArray[np.float64], cell_m: float, with_holes: bool, threads: int
) -> list[_Hills]: ...
def voxel_downsample(
    points: NDArray[Any], voxel_m: float, threads: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
def height_histogram(
    heights_m: NDArray[Any], bin_m: float, window: int
) -> tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]: ...
def ground_height(
    heights_m: NDArray[Any], bin_m: float, window: int, rule: str, lower_fraction: float
) -> float: ...
def seen(
    points: NDArray[Any],
    threads: int,
) -> tuple[
    NDArray[np.float64], tuple[float, float, float], tuple[float, float, float], int, int
]: ...
def outermost(
    points: NDArray[Any], threads: int
) -> tuple[tuple[float, float, float], tuple[float, float, float], int, int]: ...
def survey(
    points: NDArray[Any], seed: int, threads: int, own: bool
) -> tuple[float, bool, float, NDArray[np.float64], NDArray[np.float64], float, int]: ...
def find_ground(
    points: NDArray[Any],
    at: NDArray[np.float64],
    normals: NDArray[np.float64],
    threshold_m: float,
    hypotheses: int,
    cone: tuple[Sequence[float], float] | None,
    sensor: Sequence[float] | None,
    z: str,
    seed: int,
    threads: int,
) -> tuple[tuple[tuple[float, float, float], float, int, float], _UpFrom, bool]: ...
def leveling(
    points: NDArray[Any], normal: Sequence[float], threads: int
) -> NDArray[np.float64]: ...
def unevenness_of_rays(
    points: NDArray[Any], place: Sequence[float], seed: int, threads: int
) -> float | None: ...
def fit_plane(
    points: NDArray[Any],
    threshold_m: float,
    hypotheses: int,
    cone: tuple[Sequence[float], float] | None,
    seed: int,
    threads: int,
) -> tuple[tuple[float, float, float], float, int, float]: ...
def rotation_to_z(normal: Sequence[float]) -> NDArray[np.float64]: ...
def level(
    points: NDArray[np.float64],
    rotation: Sequence[Sequence[float]],
    offset_m: float,
    threads: int,
) -> None: ...

@final
class RawHeightMap:
    @property
    def heights_m(self) -> NDArray[np.float64]: ...
    @property
    def counts(self) -> NDArray[np.uint32]: ...
    @property
    def origin_m(self) -> tuple[float, float]: ...

def height_map(
    points: NDArray[Any],
    cell_m: float,
    triangulated: bool,
    mask: NDArray[np.bool_] | None,
    threads: int,
    own: bool,
) -> RawHeightMap: ...
def integrate(
    heights_above_base_m: NDArray[np.float64], cell_m: float
) -> tuple[float, float, float]: ...

@final
class RawObject:
    def judged(self, registration_m3: float, reason: Reason | None) -> RawObject: ...
    def combined_m3(self) -> float: ...
    def as_hole(self) -> RawObject: ...
    @property
    def label(self) -> int: ...
    @property
    def cut_m3(self) -> float: ...
    @property
    def fill_m3(self) -> float: ...
    @property
    def compared_m3(self) -> list[float]: ...
    @property
    def footprint_m2(self) -> float: ...
    @property
    def max_height_m(self) -> float: ...
    @property
    def centroid_m(self) -> tuple[float, float, float]: ...
    @property
    def outline_m(self) -> list[tuple[float, float, float]]: ...
    @property
    def seen_fraction(self) -> float: ...
    @property
    def touches_edge(self) -> bool: ...
    @property
    def leans_on_wall(self) -> bool: ...
    @property
    def base_from(self) -> BaseFrom | None: ...
    @property
    def reason(self) -> Reason | None: ...
    @property
    def budget(self) -> dict[str, float]: ...

def label_components(labels: NDArray[np.int32], gap: int, fewest: int) -> NDArray[np.int32]: ...

@final
class RawBase:
    def over(
        self, shape: tuple[int, ...], origin_m: Sequence[float], cell_m: float
    ) -> NDArray[np.float64]: ...

def plane_base(
    level_m: float, tilt: Sequence[float], noise_m: float, u_level_m: float, given: bool
) -> RawBase: ...
def surface_base(
    heights_m: NDArray[np.float64],
    origin_m: Sequence[float],
    cell_m: float,
    noise_m: float,
) -> RawBase: ...

_Measuring: TypeAlias = tuple[
    int, float, float, tuple[float, float, float], tuple[int, int], Sequence[RawBase | None], int
]

_FoundArrays: TypeAlias = tuple[
    NDArray[np.int32],
    NDArray[np.bool_],
    list[NDArray[np.float64] | NDArray[np.bool_]],
]

def measure_objects(
    heights_m: NDArray[np.float64],
    origin_m: Sequence[float],
    cell_m: float,
    found: _FoundArrays,
    measuring: _Measuring,
) -> tuple[list[RawObject], NDArray[np.float64]]: ...

_SeenArrays: TypeAlias = tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]

def measure_difference(
    later: _SeenArrays,
    earlier: _SeenArrays | None,
    origin_m: Sequence[float],
    cell_m: float,
    measuring: _Measuring,
) -> tuple[list[RawObject], NDArray[np.float64]]: ...
def measure_inside(
    heights_m: NDArray[np.float64],
    origin_m: Sequence[float],
    cell_m: float,
    regions: Sequence[Sequence[Sequence[Sequence[float]]]],
    found: _FoundArrays,
    measuring: _Measuring,
) -> tuple[list[RawObject], NDArray[np.float64]]: ...
def first_crossing(line: NDArray[np.float64]) -> int | None: ...
def inside(lines: Sequence[NDArray[np.float64]], at: NDArray[np.float64]) -> NDArray[np.bool_]: ...

_E57Scan: TypeAlias = tuple[list[str], NDArray[np.float64], tuple[float, ...] | None]

def read_e57(data: bytes) -> tuple[str | None, list[_E57Scan]]: ...

_Triple: TypeAlias = tuple[float, float, float]
_Pose: TypeAlias = list[list[float]]

@final
class RawCamera:
    def __new__(cls, rays: NDArray[np.float64], shape: tuple[int, int]) -> RawCamera: ...

@final
class RawPatches: ...

@final
class RawCutter:
    def __new__(cls, threads: int) -> RawCutter: ...
    def cut(self, camera: RawCamera, ranges_m: NDArray[np.float32]) -> RawPatches: ...
    def noise(self) -> tuple[float, float, float]: ...

@final
class RawJoint:
    @property
    def poses(self) -> list[_Pose | None]: ...
    @property
    def solved(self) -> list[bool]: ...
    @property
    def slides(self) -> list[bool]: ...
    @property
    def offsets_m(self) -> list[float]: ...
    @property
    def offset_m(self) -> float: ...
    @property
    def u_offset_m(self) -> float: ...
    @property
    def between_m(self) -> float: ...
    @property
    def u_height_m(self) -> float: ...
    @property
    def u_place_m(self) -> float: ...
    @property
    def place_m(self) -> float: ...
    @property
    def uneven_m(self) -> float: ...
    @property
    def loops(self) -> int: ...
    @property
    def has_floor(self) -> bool: ...
    @property
    def range_m(self) -> float: ...
    @property
    def noise(self) -> tuple[float, float, float]: ...

@final
class RawTracker:
    def __new__(cls, threads: int) -> RawTracker: ...
    def add(
        self, patches: RawPatches | None, given: _Pose | None, exact: bool
    ) -> tuple[tuple[float, float, float, tuple[float, float, float] | None] | None, str]: ...
    def poses(self) -> list[_Pose | None]: ...
    def solve(self, coefficients: tuple[float, float, float], exact: bool) -> RawJoint: ...
    def settled(self, number: int, patches: RawPatches) -> _Pose: ...
    def bytes(self) -> tuple[int, int]: ...

@final
class RawAccumulator:
    def __new__(
        cls, origin_m: tuple[float, float, float], voxel_m: float, most: int
    ) -> RawAccumulator: ...
    @staticmethod
    def from_bytes(data: bytes) -> RawAccumulator: ...
    def empty(self) -> RawAccumulator: ...
    def add(self, points: NDArray[np.floating]) -> None: ...
    def add_records(
        self,
        records: NDArray[np.uint8],
        layout: tuple[int, bool, _Triple, _Triple, _Triple],
        kept: tuple[bytes, str, tuple[_Triple, _Triple] | None],
    ) -> tuple[list[int], list[int]]: ...
    def merge(self, other: RawAccumulator) -> None: ...
    def to_bytes(self) -> bytes: ...
    def blocks(self) -> list[tuple[tuple[int, int, int], bytes]]: ...
    def held(
        self, joined: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.float64]]: ...
    @property
    def voxel_m(self) -> float: ...
    @property
    def voxels(self) -> int: ...
    @property
    def points(self) -> int: ...
    @property
    def dropped(self) -> tuple[int, int]: ...

@final
class RawFusion:
    def __new__(
        cls,
        voxel_m: float,
        coefficients: tuple[float, float, float],
        range_m: float,
        threads: int,
    ) -> RawFusion: ...
    def add(
        self, camera: RawCamera, ranges_m: NDArray[np.float32], pose: _Pose, offset_m: float
    ) -> None: ...
    def merge(self, other: RawFusion) -> None: ...
    def bytes(self) -> int: ...
    def points(
        self,
    ) -> tuple[
        NDArray[np.float64], NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float64]
    ]: ...

@final
class RawStill:
    def __new__(
        cls, shape: tuple[int, int], coefficients: tuple[float, float, float], threads: int
    ) -> RawStill: ...
    def vote(self, camera: RawCamera, ranges_m: NDArray[np.float32]) -> None: ...
    def add(self, camera: RawCamera, ranges_m: NDArray[np.float32]) -> None: ...
    def averaged(self) -> tuple[NDArray[np.float32], float, float, float]: ...
    def bytes(self) -> int: ...
