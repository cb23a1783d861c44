"""Coordinates that were rounded: u95 holds the truth, and tells of steps that matter."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot

if TYPE_CHECKING:
    from numpy.typing import NDArray

SEEDS = range(40)

Steps = tuple[float, float, float]

EXACT = (0.0, 0.0, 0.0)
#: Steps of float32 in UTM: easting below 2**19, northing below 2**23.
UTM_FLOAT32 = (2.0**-5, 0.5, 0.0)


def heap(
    seed: int, size_m: float, noise_m: float, steps_m: Steps, *, tilt: float
) -> tuple[NDArray[np.float64], float]:
    """Return a rounded cone of random place, slope and size on a tilted floor, and its volume."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 2.0 * size_m, (25_000, 3))
    middle = size_m * (1.0 + rng.uniform(-0.05, 0.05, 2))
    slope, radius = rng.uniform(0.45, 0.7), 0.5 * size_m * rng.uniform(0.8, 1.0)
    away = np.hypot(points[:, 0] - middle[0], points[:, 1] - middle[1])
    floor = points[:, :2] @ rng.normal(0.0, tilt, 2) + rng.uniform(0.0, 10.0)
    points[:, 2] = floor + np.maximum(0.0, slope * (radius - away))
    points[:, 2] += rng.normal(0.0, noise_m, len(points))
    points += (432_000.0 + rng.uniform(), 5_391_000.0 + rng.uniform(), 120.0)
    for axis, step in enumerate(steps_m):
        if step:
            points[:, axis] = np.round(points[:, axis] / step) * step
    return points, pi * radius**3 * slope / 3.0


def errors(size_m: float, noise_m: float, steps_m: Steps, *, tilt: float = 0.01) -> list[float]:
    """Return the error of each seed's pile in its u95."""
    found = []
    for seed in SEEDS:
        points, truth = heap(seed, size_m, noise_m, steps_m, tilt=tilt)
        pile = divespot.measure(points).piles[0]
        found.append(abs(pile.volume_m3 - truth) / pile.u95_m3)
    return found


@pytest.mark.parametrize(
    ("size_m", "noise_m", "steps_m", "tilt"),
    [
        (40.0, 0.02, UTM_FLOAT32, 0.01),
        (40.0, 0.02, (0.5, 0.5, 0.5), 0.0),
        (1.0, 0.003, (2.0**-5, 2.0**-5, 0.0), 0.01),
        (1.0, 0.003, (0.0, 0.0, 2.0**-5), 0.0),
    ],
    ids=["stockpile in UTM", "level stockpile", "heap in UTM", "heap in coarse heights"],
)
def test_u95_holds_the_truth_of_rounded_scans(
    size_m: float, noise_m: float, steps_m: Steps, tilt: float
) -> None:
    assert np.mean(np.array(errors(size_m, noise_m, steps_m, tilt=tilt)) <= 1.0) >= 0.9


def rounding_m3(steps_m: Steps, noise_m: float = 0.02, tilt: float = 0.0) -> float:
    points, _ = heap(0, 40.0, noise_m, steps_m, tilt=tilt)
    return divespot.measure(points).piles[0].budget.rounding_m3


def test_exact_coordinates_add_nothing() -> None:
    assert rounding_m3(EXACT) == 0.0


def test_heights_of_a_level_floor_round_to_the_same_side_unless_noise_deals_them_out() -> None:
    coarse = rounding_m3((0.0, 0.0, 0.5))
    points, _ = heap(0, 40.0, 0.02, (0.0, 0.0, 0.5), tilt=0.0)
    footprint_m2 = divespot.measure(points).piles[0].footprint_m2
    assert coarse == pytest.approx(0.5 / 12**0.5 * footprint_m2, rel=0.01)
    assert rounding_m3((0.0, 0.0, 2.0**-6)) < 1e-3 * coarse
    assert rounding_m3(UTM_FLOAT32) < 1e-2 * coarse


def test_a_float32_scan_in_utm_is_measured_as_densely_as_its_steps() -> None:
    points, truth = heap(1, 40.0, 0.02, EXACT, tilt=0.01)
    report = divespot.measure(np.repeat(points, 4, axis=0).astype(np.float32))
    assert report.settings.cell_m is not None
    assert report.settings.cell_m >= 1.0
    assert report.piles[0].volume_m3 == pytest.approx(truth, abs=report.piles[0].u95_m3)


def test_steps_that_hide_a_pile_are_refused_as_such() -> None:
    points, _ = heap(0, 1.0, 0.003, UTM_FLOAT32, tilt=0.0)
    with pytest.raises(divespot.DivespotError, match=r"y is rounded to steps of 0.5 m, 4 of them"):
        divespot.measure(points)
