"""The simulated scans that everybody gets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import divespot
from divespot import simulate

if TYPE_CHECKING:
    from pathlib import Path

SCENE = "shape-16"
#: Points of the scene at density 1, a little too few rather than too many.
POINTS_AT_ONE = 280_000


@dataclass(frozen=True)
class Scales:
    """Lengths that follow from a cloud's point spacing; about 20 neighbours within the radius."""

    radius_m: float
    voxel_m: float
    threshold_m: float


@dataclass(frozen=True)
class Cloud:
    """A scan in a file, its lengths, and the truth about it."""

    count: int
    path: Path
    scales: Scales
    volume_m3: float


def make(count: int, folder: Path) -> Cloud:
    """Simulate a scan of exactly `count` points."""
    scan, points = simulated(count, count / POINTS_AT_ONE)
    rows = np.random.default_rng(count).choice(len(points), count, replace=False)
    points = points[np.sort(rows)]
    path = folder / f"{count}.npy"
    np.save(path, points)
    seen = divespot.survey(points)
    scales = Scales(
        radius_m=2.3 * seen.spacing_m,
        voxel_m=2.0 * seen.spacing_m,
        threshold_m=max(1.5 * seen.spacing_m, 4.0 * seen.roughness_m),
    )
    return Cloud(count, path, scales, scan.volume_m3)


def simulated(count: int, density: float) -> tuple[simulate.SimulatedScan, np.ndarray]:
    """Simulate at least `count` usable points."""
    scan = simulate.scan(SCENE, density=density)
    points = scan.points[np.isfinite(scan.points).all(axis=1) & scan.points.any(axis=1)]
    return (scan, points) if len(points) >= count else simulated(count, 1.2 * density)
