"""A scan as read from a file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Whole:
    """What the header of a file says of all its points, of which only some were read.

    `low` and `high` are the corners of the box around them, in the file's numbers; `classes` are
    those of the points that were read, with how many there are; `metres` are those to the unit of
    x, y and z.
    """

    points: int
    low: tuple[float, ...]
    high: tuple[float, ...]
    classes: Mapping[int, int]
    metres: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Streamed:
    """How a scan was read in one pass, of which voxels were kept.

    `points` were wanted, of which `nonfinite` and `zero` were of no use; `voxel_m` is the edge of
    the voxels whose means the scan's points are.
    """

    points: int
    nonfinite: int
    zero: int
    voxel_m: float


@dataclass(frozen=True, eq=False)
class Registration:
    """How the frames of a scan were put together, and how well they fit.

    Attributes
    ----------
    frames
        Frames that are in the scan.
    u_height_m
        Standard uncertainty of heights above the floor that a whole pile has in common: from the
        covariance of the poses.
    u_place_m, place_m
        Standard uncertainty of heights that a place so wide has in common: from what frames differ
        by where they overlap. A pile many places wide averages it.
    u_scale
        Relative standard uncertainty of volumes by the camera's offset.
    between_m
        Standard deviation of single frames about their mean.
    offset_m, u_offset_m
        What was added to all ranges, and its standard uncertainty.
    loops
        Pairs of frames that see the same and are no neighbours in time.
    left_out
        Names of the frames that fit nowhere.
    poses
        From each frame's camera into the scan, (4, 4); None where it was left out.
    times_s
        When each frame was taken, where that is known.
    is_still
        Whether the camera stood still, and its frames were averaged.
    """

    frames: int
    u_height_m: float
    u_place_m: float
    place_m: float
    u_scale: float
    between_m: float
    offset_m: float
    u_offset_m: float
    loops: int
    left_out: tuple[str, ...]
    poses: tuple[FloatArray | None, ...]
    is_still: bool
    times_s: tuple[float, ...] | None = None


@dataclass(frozen=True, eq=False)
class Scan:
    """Points in metres, and what is known about where they came from.

    Attributes
    ----------
    points : ndarray, shape (n, 3), float64, C-contiguous
        x, y, z in metres, in the file's order and frame. Rows that are not finite and (0, 0, 0)
        rows are still there; a height that means no data is NaN.
    path : str or None
        The file, or None for points that never were in one.
    unit : str
        The unit of the file's numbers, a key of `divespot.io.UNITS`. Divide metres by
        ``UNITS[unit]`` to get back to it.
    unit_stated : bool
        Whether the file or the caller said so. If not, metres were assumed.
    crs : str or None
        The coordinate reference system in the file's own words: WKT, ``EPSG:<code>`` or a name.
    warnings : tuple of str
        What a user should know about the file, a sentence each.
    projected : bool
        Whether the reference system is a projected one, where z is up.
    viewpoint_m : tuple of float or None
        Where the file says that the sensor stood, in metres.
    raster : tuple of int or None
        Rows and columns, where the points are the pixels of a frame, row by row.
    quantum_m : tuple of float
        The steps in metres to which x, y and z were rounded, 0 where none is seen.
    format : str or None
        What the file is: ``"PLY"``, ``"LAS/LAZ"``.
    files : tuple of str
        All files, where several were merged; `path` is the first of them.
    whole : Whole or None
        What the file says of all its points, where it was asked to look at some.
    sensors_m : ndarray, shape (n, 3), or None
        Where the camera stood in each frame, of a scan that was fused from some.
    registration : Registration or None
        How its frames were put together.
    streamed : Streamed or None
        How it was read in one pass, where it is too large to be held.
    """

    points: FloatArray
    path: str | None
    unit: str
    unit_stated: bool
    crs: str | None
    warnings: tuple[str, ...]
    projected: bool = False
    viewpoint_m: tuple[float, float, float] | None = None
    raster: tuple[int, int] | None = None
    quantum_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    format: str | None = None
    files: tuple[str, ...] = ()
    whole: Whole | None = None
    sensors_m: FloatArray | None = None
    registration: Registration | None = None
    streamed: Streamed | None = None


@dataclass(frozen=True, eq=False)
class RawCloud:
    """What a reader of one format hands back: the file's numbers as they are.

    Attributes
    ----------
    xyz : ndarray, shape (n, 3), float64
    unit, vertical_unit : str or None
        What the file says its x and y, and its z, are measured in. `vertical_unit` is None where
        it says nothing of its own about z.
    crs : str or None
    warnings : tuple of str
    projected, raster, whole
        As of a `Scan`.
    viewpoint : tuple of float or None
        Where the sensor stood, in the file's numbers.
    """

    xyz: FloatArray
    unit: str | None = None
    vertical_unit: str | None = None
    crs: str | None = None
    warnings: tuple[str, ...] = ()
    projected: bool = False
    viewpoint: tuple[float, float, float] | None = None
    raster: tuple[int, int] | None = None
    whole: Whole | None = None


def stack(columns: Sequence[NDArray[Any]]) -> FloatArray:
    """Return three columns of one length as (n, 3) float64."""
    xyz = np.empty((len(columns[0]), 3))
    # A signalling NaN in a file is a NaN like any other, no reason to warn.
    with np.errstate(invalid="ignore"):
        for axis, column in enumerate(columns):
            xyz[:, axis] = column
    return xyz
