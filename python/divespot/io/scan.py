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
    """What a file's header states about all its points, if only a sample was read.

    `low` and `high` are the corners of the box around all points, in the file's numbers; `classes`
    counts the sampled points of each class; `metres` is the number of metres per unit of x, y and
    z.
    """

    points: int
    low: tuple[float, ...]
    high: tuple[float, ...]
    classes: Mapping[int, int]
    metres: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Streamed:
    """How a scan was read in one pass, keeping only voxels.

    `points` were wanted, of which `nonfinite` and `zero` were of no use; `voxel_m` is the edge of
    the voxels whose means the scan's points are. `blocks` keep finer ones.
    """

    points: int
    nonfinite: int
    zero: int
    voxel_m: float
    blocks: Any = None


@dataclass(frozen=True, eq=False)
class Registration:
    """The registration of a scan's frames, and its uncertainty.

    Attributes
    ----------
    frames
        Number of frames in the scan.
    u_height_m
        Standard uncertainty of heights above the floor that is common to a whole pile, from the
        covariance of the poses.
    u_place_m, place_m
        Standard uncertainty of heights common to places of this width, from the differences
        between frames where they overlap. Over a pile many places wide it averages out.
    u_scale
        Relative standard uncertainty of volumes due to the camera's offset.
    between_m
        Standard deviation of single frames about their mean.
    offset_m, u_offset_m
        Offset that was added to all ranges, and its standard uncertainty.
    loops
        Pairs of overlapping frames that are not neighbours in time.
    left_out
        Names of frames that could not be registered.
    poses
        Pose (4, 4) from each frame's camera to the scan; None if the frame was left out.
    times_s
        Time of each frame, if known.
    is_still
        Whether the camera did not move, and its frames were averaged.
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
    """Points in metres, and their origin.

    Attributes
    ----------
    points : ndarray, shape (n, 3), float64, C-contiguous
        x, y, z in metres, in the file's order and frame, including rows that are not finite or
        are (0, 0, 0); no-data heights are NaN.
    path : str or None
        The file, or None for points that did not come from one.
    unit : str
        The unit of the file's numbers, a key of `divespot.io.UNITS`. Metres divided by
        ``UNITS[unit]`` are the file's numbers.
    unit_stated : bool
        Whether the file or the caller stated the unit. If not, metres were assumed.
    crs : str or None
        The coordinate reference system as the file writes it: WKT, ``EPSG:<code>`` or a name.
    warnings : tuple of str
        What a user should know about the file, one sentence each.
    projected : bool
        Whether the reference system is a projected one, where z is up.
    viewpoint_m : tuple of float or None
        The sensor's position in metres, if the file states it.
    raster : tuple of int or None
        Rows and columns, if the points are the pixels of a frame, row by row.
    quantum_m : tuple of float
        The steps in metres to which x, y and z were rounded, 0 if there is no rounding.
    format : str or None
        The file's format: ``"PLY"``, ``"LAS/LAZ"``.
    files : tuple of str
        All files, if several were merged; `path` is the first of them.
    whole : Whole or None
        What the file states about all its points, if only a sample was read.
    sensors_m : ndarray, shape (n, 3), or None
        The camera's position in each frame, if the scan was fused from frames.
    registration : Registration or None
        The registration of its frames.
    streamed : Streamed or None
        How it was read in one pass, if it is too large for memory.
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
    """The result of a reader of one format: the file's numbers unchanged.

    Attributes
    ----------
    xyz : ndarray, shape (n, 3), float64
    unit, vertical_unit : str or None
        The units of x and y, and of z, as the file states them. `vertical_unit` is None if there
        is no separate one for z.
    crs : str or None
    warnings : tuple of str
    projected, raster, whole
        As for a `Scan`.
    viewpoint : tuple of float or None
        The sensor's position, in the file's numbers.
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
    # A signalling NaN in a file is handled like any other NaN, without a warning.
    with np.errstate(invalid="ignore"):
        for axis, column in enumerate(columns):
            xyz[:, axis] = column
    return xyz
