"""A stockyard of forty piles of exact volume, as a LAZ file of any number of points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import laspy
import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

#: Piles along x and y, and how far apart.
COLUMNS, ROWS, PITCH_M = 8, 5, 40.0
WIDTH_M, DEPTH_M = COLUMNS * PITCH_M, ROWS * PITCH_M

#: Where the yard lies in UTM.
CORNER_M = (482_300.0, 5_456_700.0, 312.0)

#: Rise of the ground along x, standard deviation of heights, steps of coordinates.
SLOPE, NOISE_M, STEP_M = 0.005, 0.01, 0.001

#: Rise over run of cones.
STEEP = 0.7

#: Points that are made and written at a time.
BATCH = 2_000_000


@dataclass(frozen=True)
class Heap:
    """A pile on an ellipse: a cone, one with its top cut off at `top` of its radius, or a dome.

    `at_m` is its middle, `axes_m` its half axes along x and y.
    """

    at_m: tuple[float, float]
    axes_m: tuple[float, float]
    height_m: float
    top: float
    is_dome: bool

    @property
    def volume_m3(self) -> float:
        """Exact volume above the ground."""
        ground_m2 = math.pi * self.axes_m[0] * self.axes_m[1]
        if self.is_dome:
            return ground_m2 * self.height_m / 2.0
        return ground_m2 * self.height_m * (1.0 + self.top + self.top**2) / 3.0

    def heights_m(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return heights above the ground."""
        (x0, y0), (a, b) = self.at_m, self.axes_m
        out = np.hypot((x - x0) / a, (y - y0) / b)
        if self.is_dome:
            return self.height_m * np.maximum(0.0, 1.0 - out**2)
        return self.height_m * np.clip((1.0 - out) / (1.0 - self.top), 0.0, 1.0)


def heaps() -> list[Heap]:
    """Return the piles, row by row."""
    found = []
    for i in range(COLUMNS * ROWS):
        at_m = ((i % COLUMNS + 0.5) * PITCH_M, (i // COLUMNS + 0.5) * PITCH_M)
        b = 6.0 + 0.2 * i
        a = (1.0, 1.15, 0.9)[i % 3] * b
        top, is_dome = (0.0, 0.3, 0.0, 0.5)[i % 4], i % 4 == 2
        steep = STEEP / 2.0 if is_dome else STEEP * (1.0 - top)
        found.append(Heap(at_m, (a, b), steep * min(a, b), top, is_dome))
    return found


def write_yard(path: Path, points: int, seed: int = 0) -> int:
    """Write the yard, one point in each cell of a grid, row by row; return how many there are."""
    return write_las(path, _batches(points, np.random.default_rng(seed)))


def write_las(path: Path, batches: Iterable[NDArray[np.float64]]) -> int:
    """Write points relative to `CORNER_M`, batch by batch; return how many there are."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [STEP_M] * 3, CORNER_M
    written = 0
    backend = laspy.LazBackend.LazrsParallel
    with laspy.open(path, mode="w", header=header, laz_backend=backend) as writer:
        for xyz in batches:
            record = laspy.ScaleAwarePointRecord.zeros(len(xyz), header=header)
            record.x, record.y, record.z = (xyz + CORNER_M).T
            record.return_number[:] = record.number_of_returns[:] = 1
            writer.write_points(record)
            written += len(xyz)
    return written


def _batches(points: int, rng: np.random.Generator) -> Iterator[NDArray[np.float64]]:
    step = math.sqrt(WIDTH_M * DEPTH_M / points)
    across, rows = round(WIDTH_M / step), round(DEPTH_M / step)
    at_once = max(1, BATCH // across)
    piles = heaps()
    for first in range(0, rows, at_once):
        row = np.arange(first, min(first + at_once, rows))
        column, row = (v.ravel() for v in np.meshgrid(np.arange(across), row))
        x = (column + rng.random(len(row))) * (WIDTH_M / across)
        y = (row + rng.random(len(row))) * (DEPTH_M / rows)
        yield np.column_stack([x, y, _heights_m(x, y, piles) + rng.normal(0.0, NOISE_M, len(x))])


def _heights_m(
    x: NDArray[np.float64], y: NDArray[np.float64], piles: list[Heap]
) -> NDArray[np.float64]:
    z = SLOPE * x
    cell = (y // PITCH_M).astype(int) * COLUMNS + (x // PITCH_M).astype(int)
    for number in np.unique(cell):
        own = cell == number
        z[own] += piles[number].heights_m(x[own], y[own])
    return z
