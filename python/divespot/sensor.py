"""Evidence for up: the sensor's position, and whether coordinates are those of a survey."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from divespot import _native

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.directions import Position
    from divespot.io import Scan
    from divespot.settings import Settings

#: Points are taken as rays from a position if their spacings, seen as directions from there, are at
#: most this fraction as uneven as in space and in plan. Frames of depth cameras have 0.0 to 0.4, of
#: lidars 0.4 to 0.7; fused or flown clouds have 1.0 and more, or points hidden behind others.
MOST_UNEVEN = 0.8

#: The same if the file states the sensor's position or a raster, which points must not contradict.
MOST_UNEVEN_STATED = 1.0

#: Most pixels of a raster that are examined, in evenly spaced rows and columns.
LOOKED_AT = 10_000

#: Replaces a divisor of 0.
SMALLEST = 1e-300
ORIGIN = (0.0, 0.0, 0.0)

#: Coordinates are those of a projected system if they are farther than this from the origin, in
#: metres, and than this many sizes of the scan: projected grids begin hundreds of kilometres away,
#: while a sensor is at its own origin.
PROJECTED_M = 1e4
PROJECTED_SIZES = 20.0

#: Above any ground, in metres: such coordinates are geocentric, and z is not a height.
HIGHEST_M = 9e3

#: Half angle of the widest view of a camera or a hanging lidar; largest angle between the middle of
#: the view and one of its axes; largest range in metres.
VIEW_DEG = 70.0
MIDDLE_DEG = 20.0
FARTHEST_M = 100.0


def sensor_place(
    scan: Scan, points: NDArray[np.float64], origin: Position, settings: Settings
) -> Position | None:
    """Return the sensor's position, in metres in the scan's frame, if it is known.

    If the file states a position, it is in the frame of the points, or the points are still in the
    sensor's own frame: the one from which all points can have been seen is taken. Without a stated
    position the scan may be a single frame with the sensor at the origin. `points` are the scan's
    seen points, relative to `origin`.
    """
    stated = scan.viewpoint_m is not None or scan.raster is not None
    places = (ORIGIN,) if scan.viewpoint_m is None else (scan.viewpoint_m, ORIGIN)
    if scan.raster is not None:
        points, origin, *_ = _native.seen(_thinned(scan.points, scan.raster), settings.threads)
    most = MOST_UNEVEN_STATED if stated else MOST_UNEVEN
    for place in places:
        from_origin = np.subtract(place, origin).tolist()
        uneven = _native.unevenness_of_rays(points, from_origin, settings.seed, settings.threads)
        if uneven is not None and uneven <= most:
            return place
    return scan.viewpoint_m


def _thinned(points: NDArray[np.floating], raster: tuple[int, int]) -> NDArray[np.floating]:
    """Return the pixels of evenly spaced rows and columns."""
    step = max(1, math.isqrt(len(points) // LOOKED_AT))
    return points.reshape(*raster, 3)[::step, ::step].reshape(-1, 3)


def axis_z(places_m: NDArray[np.float64]) -> Literal["up", "ahead", "behind"]:
    """Return what z may be for a sensor at the origin; up if no sensor can have been there.

    All points may be ahead along z, as in a depth camera's own frame, or along -z, as below a
    lidar that hangs upright or before a camera in the convention of computer graphics.
    """
    range_m = np.maximum(np.linalg.norm(places_m, axis=1), SMALLEST)
    low, middle, high = np.quantile(places_m / range_m[:, None], (0.01, 0.5, 0.99), axis=0)
    in_view = math.cos(math.radians(VIEW_DEG))
    beside = math.hypot(middle[0], middle[1]) > math.sin(math.radians(MIDDLE_DEG))
    if beside or np.quantile(range_m, 0.99) > FARTHEST_M or max(low[2], -high[2]) < in_view:
        return "up"
    return "ahead" if low[2] > 0.0 else "behind"


def is_survey(places_m: NDArray[np.float64]) -> bool:
    """Return whether the coordinates can only be those of a projected system."""
    low, middle, high = np.quantile(places_m, (0.05, 0.5, 0.95), axis=0)
    size_m = float((high - low).max())
    off_m = float(np.abs(middle[:2]).max())
    return bool(off_m >= max(PROJECTED_M, PROJECTED_SIZES * size_m) and middle[2] <= HIGHEST_M)
