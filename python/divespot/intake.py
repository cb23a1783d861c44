"""From a file or an array to finite points near a local origin (paper, Pre-process 1)."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from divespot import _native
from divespot._arguments import as_floats
from divespot.errors import DivespotError, NothingSeenError
from divespot.io import UNITS, Scan, read
from divespot.io.doubts import judged
from divespot.io.merge import are_paths
from divespot.io.systems import require_system
from divespot.narrowing import plan_of
from divespot.projection import scale_of
from divespot.selection import rows_of
from divespot.sensor import sensor_place
from divespot.too_large import is_too_large

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from divespot.directions import Position
    from divespot.io.scan import Registration, Streamed
    from divespot.settings import Settings

#: Fewest points of a scan.
FEWEST = 10
#: Smallest extent of a scan, in metres.
SMALLEST_M = 1e-6
#: Fewest rounding steps across a scan: a pile a third as wide then spans seven steps.
FEWEST_STEPS = 20


class LegacyCloud(Protocol):
    """An object that holds points like Open3D's legacy clouds."""

    @property
    def points(self) -> Any:  # noqa: ANN401 - whatever NumPy makes an array of
        """Its points."""


class TensorCloud(Protocol):
    """An object that holds points like Open3D's tensor clouds: as ``point.positions``."""

    @property
    def point(self) -> Any:  # noqa: ANN401 - a map of tensors
        """The attributes of its points."""


#: A scan, a path, several paths that are one survey, points, or an object that holds points.
Scannable: TypeAlias = (
    "Scan | str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | ArrayLike "
    "| LegacyCloud | TensorCloud"
)

#: What returns other points.
Alter: TypeAlias = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Source:
    """Where the points came from and how many were unusable.

    Attributes
    ----------
    path
        The file; null for an array.
    points
        Points that were read, including unusable ones.
    dropped_nonfinite
        Points with a coordinate that is not finite.
    dropped_zero
        Points at (0, 0, 0): pixels without a depth.
    unit
        Unit of the file's numbers and of the report's positions.
    crs
        Coordinate reference system, as far as the file states it.
    files
        All files if several were merged; `path` is the first of them.
    scale_factor
        Metres of the map per metre on the ellipsoid, if the projection is known; a scale more than
        100 ppm off is corrected.

    """

    path: str | None
    points: int
    dropped_nonfinite: int
    dropped_zero: int
    unit: str
    crs: str | None
    files: tuple[str, ...] = ()
    scale_factor: float | None = None


@dataclass(frozen=True, eq=False)
class Cloud:
    """Finite points in metres relative to `origin_m`, and where they came from.

    z is up in a `projected` system. `sensor_m` is where the sensor stood, in the scan's frame and
    in metres, where that is known. `quantum_m` are the steps to which x, y and z were rounded
    before they came here, as those of float32 in UTM; 0 where none is seen: each coordinate has
    the standard uncertainty step / sqrt(12). `scale` are metres of the scan's x and y to a metre
    of the cloud's. `registration` says how well frames fit that it was fused from.
    What was `streamed` was cropped while it was read; `alter` is done to what is loaded of it.
    """

    points: NDArray[np.float64]
    origin_m: NDArray[np.float64]
    source: Source
    warnings: tuple[str, ...]
    projected: bool = False
    sensor_m: Position | None = None
    quantum_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale: float = 1.0
    registration: Registration | None = None
    streamed: Streamed | None = None
    alter: Alter = np.copy

    def altered(self, alter: Alter = np.copy) -> Cloud:
        """Return a cloud with other points, by default a copy, for what uses them up."""
        return replace(self, points=alter(self.points), alter=alter)

    def without_points(self) -> Cloud:
        """Return the cloud without its points, so that their memory can be freed."""
        return replace(self, points=np.empty((0, 3)))


def load(source: Scannable, settings: Settings) -> Cloud:
    """Read a scan; drop and count points that are not finite and points at (0, 0, 0).

    Depth cameras mark pixels without a depth in either way.

    Raises
    ------
    DivespotError
        The file cannot be read, the array has the wrong shape or type, or no point is left.

    """
    return cloud_of(_scan(source, settings), settings)


def cloud_of(scan: Scan, settings: Settings) -> Cloud:
    """Drop and count the unseen points of a scan, as `load` does."""
    points, origin, extent_m, nonfinite, zero = _native.seen(scan.points, settings.threads)
    if len(points) < FEWEST:
        raise NothingSeenError(
            f"{scan.path or 'the array'}: of {len(scan.points)} points {nonfinite} are not finite "
            f"and {zero} are (0, 0, 0): at least {FEWEST} others are needed"
        )
    if (size := max(extent_m)) < SMALLEST_M:
        raise DivespotError(
            f"{scan.path or 'the array'}: the points span {size:.2g} m: at least {SMALLEST_M:g} m "
            "is needed"
        )
    _refuse_coarse(scan, extent_m)
    unstated = f"the scan does not state its unit: {scan.unit} was assumed"
    warnings = scan.warnings if scan.unit_stated else (*scan.warnings, unstated)
    counts = (len(scan.points), nonfinite, zero)
    if scan.streamed is not None:
        counts = (scan.streamed.points, scan.streamed.nonfinite, scan.streamed.zero)
    place = sensor_place(scan, points, origin, settings)
    factor, told = scale_of(scan, np.array(origin) + 0.5 * np.array(extent_m))
    scale = factor if factor is not None and told else 1.0
    if scale != 1.0:
        points[:, :2] /= scale
    return Cloud(
        points,
        np.array(origin),
        Source(scan.path, *counts, scan.unit, scan.crs, scan.files, factor),
        (*warnings, *told),
        scan.projected,
        place,
        scan.quantum_m,
        scale,
        scan.registration,
        streamed=scan.streamed,
    )


def _refuse_coarse(scan: Scan, extent_m: Position) -> None:
    """Raise DivespotError if x or y have too few rounding steps across the scan to show a pile."""
    for axis, width_m, step_m in zip("xy", extent_m, scan.quantum_m, strict=False):
        steps = round(width_m / step_m) if step_m else 0
        if 2 < steps < FEWEST_STEPS:
            raise DivespotError(
                f"{scan.path or 'the array'}: its {axis} is rounded to steps of {step_m:g} m, "
                f"{steps} of them across the scan: coordinates that were not rounded are needed, "
                "as float64 keeps them"
            )


def _scan(source: Scannable, settings: Settings) -> Scan:
    if isinstance(source, Scan):
        return source
    if isinstance(source, str | os.PathLike) or are_paths(source):
        if is_too_large(source, settings):
            from divespot.streaming import streamed  # noqa: PLC0415 - few scans are so large

            return streamed(source, settings)
        return read(
            source,
            unit=settings.unit,
            crs=settings.crs,
            columns=settings.columns,
            classes=settings.classes,
            returns=settings.returns,
            plan=plan_of(settings),
        )
    array = as_floats("points", _positions(source))
    if array.ndim not in (2, 3) or array.shape[-1] != 3 or array.dtype.kind != "f":
        raise DivespotError(
            f"points have shape {array.shape} and dtype {array.dtype}: shape (n, 3) or (h, w, 3) "
            "and numbers are needed"
        )
    if settings.crs is not None:
        require_system(settings.crs)
    raster = array.shape[:2] if array.ndim == 3 and min(array.shape[:2]) > 1 else None
    array = array.reshape(-1, 3)
    unit = "m" if settings.unit == "auto" else settings.unit
    seen = judged(array, unit, stated=settings.unit != "auto")
    points = seen.xyz if UNITS[unit] == 1.0 else seen.xyz * np.float64(UNITS[unit])
    x, y, z = (seen.quantum * UNITS[unit]).tolist()
    return Scan(
        *(points, None, unit),
        unit_stated=True,
        crs=settings.crs,
        warnings=seen.warnings,
        raster=raster,
        quantum_m=(x, y, z),
    )


def _positions(source: Any) -> ArrayLike:  # noqa: ANN401 - whatever holds points
    """Return the points of an Open3D object; anything else is returned as it is."""
    if isinstance(source, np.ndarray):
        return source
    tensor = getattr(getattr(source, "point", None), "positions", None)
    if tensor is not None:
        return np.asarray(tensor.cpu().numpy())
    return np.asarray(source.points) if hasattr(source, "points") else source


def crop(cloud: Cloud, settings: Settings) -> Cloud:
    """Keep the points inside the box (pass-through filter).

    Raises
    ------
    DivespotError
        Too few points are inside.

    """
    if settings.crop is None or cloud.streamed is not None:
        return cloud
    corners = np.array(settings.crop).reshape(2, 3) * UNITS[cloud.source.unit] - cloud.origin_m
    corners[:, :2] /= cloud.scale
    inside = ((cloud.points >= corners[0]) & (cloud.points <= corners[1])).all(axis=1)
    if inside.sum() < FEWEST:
        raise NothingSeenError(
            f"crop keeps {inside.sum()} of {len(inside)} points: at least {FEWEST} are needed"
        )
    return replace(cloud, points=rows_of(cloud.points, inside))
