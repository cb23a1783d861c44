"""Holes in the ground have the volume that is missing, and are no piles."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray

import divespot

Floats = NDArray[np.float64]

PIT_M3 = pi * 0.5**2 * 0.2 / 3
NOISE_M = 0.001


def scan(height: Floats, x: Floats, y: Floats) -> Floats:
    points = np.column_stack([x.ravel(), y.ravel(), height.ravel()])
    return np.asarray(points + np.random.default_rng(1).normal(0, NOISE_M, points.shape))


def cone(x: Floats, y: Floats, at_x: float, top_m: float) -> Floats:
    return np.asarray(top_m * np.maximum(1 - np.hypot(x - at_x, y) / 0.5, 0))


@pytest.fixture
def plan() -> tuple[Floats, Floats]:
    x, y = np.meshgrid(np.arange(-1.6, 1.6, 0.01), np.arange(-1.2, 1.2, 0.01))
    return x, y


def test_a_pit_beside_a_heap_is_a_hole_of_its_own_volume(plan: tuple[Floats, Floats]) -> None:
    x, y = plan
    report = divespot.measure(scan(cone(x, y, -0.8, 0.25) - cone(x, y, 0.8, 0.2), x, y))
    (pile,), (hole,) = report.piles, report.other_objects
    assert hole.reason == "hole"
    assert hole.volume_m3 == pytest.approx(-PIT_M3, rel=0.01)
    assert abs(hole.volume_m3 + PIT_M3) < hole.u95_m3
    assert hole.max_height_m == pytest.approx(-0.2, abs=0.01)
    assert hole.centroid_m[0] == pytest.approx(0.8, abs=0.01)
    assert hole.centroid_m[2] < 0
    assert pile.volume_m3 == pytest.approx(1.25 * PIT_M3, rel=0.01)
    assert report.total.volume_m3 == pile.volume_m3


def test_a_hollow_in_a_pile_is_the_piles(plan: tuple[Floats, Floats]) -> None:
    x, y = plan
    heap = 2 * cone(x, y, 0.0, 0.25) - 3 * np.maximum(0.2 - np.hypot(x, y), 0)
    report = divespot.measure(scan(np.maximum(heap, 0), x, y))
    assert len(report.piles) == 1
    assert not [other for other in report.other_objects if other.reason == "hole"]


def test_below_a_base_that_was_given_nothing_is_a_hole(plan: tuple[Floats, Floats]) -> None:
    x, y = plan
    report = divespot.measure(scan(-cone(x, y, 0.8, 0.2), x, y), base="height=0", up="z")
    assert not [other for other in report.other_objects if other.reason == "hole"]
