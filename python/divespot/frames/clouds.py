"""Sequences of clouds, one per frame, converted to ranges on a grid of directions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.errors import DivespotError
from divespot.frames.views import Views
from divespot.io import read

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from divespot.frames.source import Frames
    from divespot.frames.views import Frame

#: Mean number of points per pixel of a grid for scattered points: nine of ten pixels have one.
POINTS = 2.25
#: Steps along each axis in which the directions of a sensor's points are counted.
STEPS = 64
#: Most pixels of a grid.
MOST_PIXELS = 1 << 24


@dataclass(frozen=True, eq=False, kw_only=True)
class CloudView(Views):
    """Clouds as frames: each has its own rays, in the axes of its sensor at the origin."""

    @classmethod
    def of(cls, source: Frames, threads: int) -> CloudView:
        """Take the angular spacing of all clouds from the first one."""
        rays, ranges_m = _grid(_points(source, 0))
        seen = np.isfinite(ranges_m)
        steps = [np.linalg.norm(np.diff(rays, axis=axis), axis=2) for axis in (0, 1)]
        both = seen[1:] & seen[:-1], seen[:, 1:] & seen[:, :-1]
        both_steps = [s[b] for s, b in zip(steps, both, strict=True) if b.any()]
        # A camera's pixels are widest in the middle.
        pitches = [float(np.quantile(step, 0.9)) for step in both_steps]
        return cls(source=source, pitch=max(pitches, default=0.01), threads=threads)

    def frame(self, number: int) -> Frame:
        """Return a frame: its camera and its ranges."""
        rays, ranges_m = _grid(_points(self.source, number))
        rows, columns = ranges_m.shape
        return _native.RawCamera(rays.reshape(-1, 3), (rows, columns)), ranges_m


def _points(source: Frames, number: int) -> tuple[NDArray[np.float64], tuple[int, int] | None]:
    """Return the points of a cloud, and its rows and columns if it is organized."""
    path: Path = source.items[number]  # type: ignore[assignment]  # clouds are files
    scan = read(path)
    if len(scan.points) < 9:
        raise DivespotError(f"{path}: has {len(scan.points)} points: a frame of more is needed")
    return scan.points, scan.raster


Grid = tuple["NDArray[np.float64]", "NDArray[np.float32]"]


def _grid(cloud: tuple[NDArray[np.float64], tuple[int, int] | None]) -> Grid:
    """Return rays of shape (rows, columns, 3), and ranges, NaN for empty pixels."""
    points, raster = cloud
    with np.errstate(invalid="ignore", over="ignore"):
        range_m = np.sqrt((points**2).sum(axis=1))
    seen = np.isfinite(range_m) & (range_m > 0.0)
    if raster is not None and min(raster) >= 3:
        range_m[~seen] = np.nan
        with np.errstate(invalid="ignore"):
            rays = points / range_m[:, None]
        return _whole(rays.reshape(*raster, 3)), range_m.reshape(raster).astype(np.float32)
    return _scattered(points[seen], range_m[seen])


def _whole(rays: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rays, with those of empty pixels interpolated along their rows."""
    at = np.arange(rays.shape[1])
    for row in rays:
        seen = np.isfinite(row[:, 0])
        if seen.any() and not seen.all():
            for axis in range(3):
                row[~seen, axis] = np.interp(at[~seen], at[seen], row[seen, axis])
    return rays


def _scattered(points: NDArray[np.float64], range_m: NDArray[np.float64]) -> Grid:
    """Put scattered points on a grid, averaging those in one pixel except at edges."""
    rays = points / range_m[:, None]
    across, down = _angles(rays)
    low = across.min(), down.min()
    size = max(np.ptp(across), 1e-6), max(np.ptp(down), 1e-6)
    taken = np.histogram2d(across, down, bins=STEPS)[0] > 0
    pitch = math.sqrt(POINTS * size[0] * size[1] * taken.mean() / len(points))
    columns, rows = (max(3, int(extent / pitch) + 1) for extent in size)
    if rows * columns > MOST_PIXELS:
        raise DivespotError("a cloud's points lie too far apart for a frame: one sweep is needed")
    column = np.minimum(((across - low[0]) / pitch).astype(int), columns - 1)
    row = np.minimum(((down - low[1]) / pitch).astype(int), rows - 1)
    pixel = row * columns + column
    nearest = np.full(rows * columns, np.inf)
    np.minimum.at(nearest, pixel, range_m)
    # Points in front of an edge are not averaged with points behind it.
    kept = range_m <= nearest[pixel] * (1.0 + 6.0 * pitch)
    pixel, range_m, rays = pixel[kept], range_m[kept], rays[kept]
    count = np.bincount(pixel, minlength=rows * columns).astype(np.float64)
    with np.errstate(invalid="ignore"):
        mean_m = np.bincount(pixel, range_m, rows * columns) / count
        sums = [np.bincount(pixel, rays[:, k], rows * columns) for k in range(3)]
        mean = np.stack(sums, axis=1).astype(np.float64)
        mean = mean / np.sqrt((mean**2).sum(axis=1))[:, None]
    shaped = _whole(mean.reshape(rows, columns, 3))
    return shaped, mean_m.reshape(rows, columns).astype(np.float32)


def _angles(rays: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return directions as two numbers: on a camera's image plane, else azimuth and elevation."""
    if (rays[:, 2] > 0.2).all():
        return rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
    return np.arctan2(rays[:, 1], rays[:, 0]), -np.arcsin(np.clip(rays[:, 2], -1.0, 1.0))
