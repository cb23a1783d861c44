"""Memory and time against the size of the scene: inner voxels and ground grid."""

from __future__ import annotations

import math
import time
import tracemalloc
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.grid import height_map, integrate
from divespot.reproduce.charts import Chart, Line
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Picture, Section, Table
from divespot.volume import inner_voxels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from divespot.reproduce.found import Found, Round
    from divespot.reproduce.plan import Plan

VOXEL_M = 0.01
REPOSE = math.tan(math.radians(23.0))
LABELS = {"voxels": "inner voxels", "grid": "ground grid"}
GOALS = {"voxels": (3.0, 0.15), "grid": (2.0, 0.1)}
"""Exponent of each method's memory, and its tolerance."""


def cone(layers: int) -> NDArray[np.float64]:
    """Return a cone of corn, `layers` voxels high, with a point in the middle of each column."""
    height = layers * VOXEL_M
    radius = round(height / REPOSE / VOXEL_M)
    x, y = (np.indices((2 * radius, 2 * radius)) - (radius - 0.5)).reshape(2, -1) * VOXEL_M
    return np.column_stack([x, y, np.maximum(height - np.hypot(x, y) * REPOSE, 0.0)])


def by_grid(points: NDArray[np.float64]) -> tuple[float, int]:
    """Return the volume by the ground grid, and the bytes of its height map."""
    grid = height_map(points, VOXEL_M)
    held = grid.heights_m.nbytes + grid.counts.nbytes
    return integrate(grid.heights_m, VOXEL_M).volume_m3, held


def by_voxels(points: NDArray[np.float64]) -> tuple[float, int]:
    """Return the volume by inner voxels, and the bytes that the core holds: none."""
    return inner_voxels(points, VOXEL_M), 0


METHODS = {"voxels": by_voxels, "grid": by_grid}


@dataclass(frozen=True)
class MemoryRound:
    """A method on a cone of one size: peak memory without the points."""

    memory_of: str
    layers: int

    def result(self) -> dict[str, Any]:
        """Return bytes and the volume."""
        points = cone(self.layers)
        tracemalloc.start()
        try:
            volume, held = METHODS[self.memory_of](points)
            _, peak = tracemalloc.get_traced_memory()
        finally:
            tracemalloc.stop()
        return {"bytes": peak + held, "volume_m3": volume}


@dataclass(frozen=True)
class GrowingTimeRound:
    """A method on a cone of one size: its shortest time of three."""

    time_of: str
    layers: int

    def result(self) -> dict[str, Any]:
        """Return seconds."""
        points = cone(self.layers)
        seconds = []
        for _ in range(3):
            begin = time.perf_counter()
            METHODS[self.time_of](points)
            seconds.append(time.perf_counter() - begin)
        return {"seconds": min(seconds)}


def rounds(plan: Plan) -> list[Round]:
    """Return each method at each size, the largest first."""
    return [MemoryRound(method, n) for n in reversed(plan.layers) for method in METHODS]


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return the slope of a straight line fitted to the logarithms by least squares."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1)[0])


def growth(values: dict[str, list[float]], layers: Sequence[int]) -> dict[str, float]:
    """Return the exponent of each method."""
    return {method: exponent(layers, of) for method, of in values.items()}


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    taken = {
        method: [float(found.results[MemoryRound(method, n)]["bytes"]) for n in plan.layers]
        for method in METHODS
    }
    slopes = growth(taken, plan.layers)
    return Section(
        "Memory against the size of the scene",
        [
            _told(),
            sizes_table(taken, plan.layers, "MB", 1e-6),
            growth_picture("memory", "peak memory in MB", taken, plan.layers, 1e-6),
        ],
        {"layers": plan.layers, "bytes": taken, "exponents": slopes},
        [_finding(method, slope) for method, slope in slopes.items()],
    )


def _told() -> str:
    return (
        f"Cones of corn at 23°, sampled every {1000 * VOXEL_M:.0f} mm, counted in inner voxels and "
        "integrated over the ground grid, both with that edge. Memory is the peak of a method "
        "without the points, by Python's `tracemalloc`, plus the height map that the core "
        "returns. The size is the height of the cone in voxels."
    )


def _finding(method: str, slope: float) -> Finding:
    goal, off = GOALS[method]
    return Finding(
        f"the memory of {LABELS[method]} grows with the power {goal} ± {off} of the size",
        abs(slope - goal) <= off,
        f"{slope:.2f}",
    )


def sizes_table(
    values: dict[str, list[float]], layers: Sequence[int], unit: str, scale: float
) -> Table:
    """Return a row for each size and one for the exponents."""
    header = ("size in voxels", *(f"{LABELS[method]} {unit}" for method in values))
    texts = [
        (str(n), *(f"{scale * of[i]:.4g}" for of in values.values())) for i, n in enumerate(layers)
    ]
    slopes = (f"{slope:.2f}" for slope in growth(values, layers).values())
    return Table(header, (*texts, ("fitted exponent", *slopes)))


def growth_picture(
    name: str, label: str, values: dict[str, list[float]], layers: Sequence[int], scale: float
) -> Picture:
    """Return the chart of values against sizes, with the fitted lines."""
    sizes = tuple(float(n) for n in layers)
    lines = []
    for method, of in values.items():
        y = tuple(scale * value for value in of)
        slope, level = np.polyfit(np.log(sizes), np.log(y), 1)
        fitted = tuple(float(np.exp(level + slope * np.log(n))) for n in sizes)
        lines.append(Line(LABELS[method], sizes, y))
        lines.append(Line(f"exponent {slope:.2f}", sizes, fitted, dashed=True))
    chart = Chart("height of the cone in voxels", label, tuple(lines), log_x=True, log_y=True)
    what = label.split(" in ", maxsplit=1)[0].capitalize()
    return Picture(name, f"{what} against size, log-log", chart)


EXPERIMENT = Experiment("growth", section, rounds=rounds)
