"""Simulated scans, their volumes known, measured with no option given."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import divespot
from divespot import Report
from divespot.simulate import NAMES, SimulatedScan, scan

SHAPES = [name for name in NAMES if name.startswith("shape-")]
ENOUGH = 0.1
"""Share of a scene's points at which posts and boxes still look like what they are."""


@cache
def taken(name: str, density: float = ENOUGH) -> SimulatedScan:
    return scan(name, density=density)


@cache
def measured(name: str, density: float = ENOUGH) -> Report:
    return divespot.measure(taken(name, density).points)


def check_largest_is_the_pile(name: str, within: float, density: float = ENOUGH) -> None:
    truth, report = taken(name, density), measured(name, density)
    assert report.piles[0].volume_m3 == pytest.approx(max(truth.volumes_m3), rel=within)
    assert np.dot(report.ground.normal, truth.up) > np.cos(np.radians(1.0))
    at = np.array(report.piles[0].centroid_m) * truth.scene.unit_m - truth.pose[:3, 3]
    x, y, _ = at @ truth.pose[:3, :3]
    surface = truth.surface
    owner = surface.owner[np.abs(surface.y - y).argmin(), np.abs(surface.x - x).argmin()]
    assert owner == 1 + int(np.argmax(truth.volumes_m3))


def test_there_are_18_shapes() -> None:
    assert len(SHAPES) == 18


@pytest.mark.parametrize("name", SHAPES)
def test_the_largest_pile_of_a_shape_is_its_pile(name: str) -> None:
    check_largest_is_the_pile(name, 0.02)
    # Posts, rail and boxes around the strip are none.
    assert len(measured(name).piles) == 1


def test_a_shape_at_full_density() -> None:
    check_largest_is_the_pile("shape-05", 0.01, density=1.0)
    assert len(measured("shape-05", 1.0).piles) == 1


@pytest.mark.parametrize(
    ("name", "within"),
    [
        ("upside-down", 0.02),
        ("optical-frame", 0.02),
        ("utm-yard", 0.02),
        ("heap-10cm", 0.02),
        ("grain-2m", 0.02),
        ("strays", 0.03),
        ("wavering-floor", 0.03),
    ],
)
def test_other_frames_sizes_and_floors_need_no_option(name: str, within: float) -> None:
    check_largest_is_the_pile(name, within)


@pytest.mark.parametrize("name", ["three-piles", "utm-yard"])
def test_piles_that_stand_apart_are_all_found(name: str) -> None:
    truth = sorted(taken(name).volumes_m3, reverse=True)
    found = [pile.volume_m3 for pile in measured(name).piles]
    assert found[:3] == pytest.approx(truth, rel=0.03)


def test_three_piles_are_three_and_add_up() -> None:
    report = measured("three-piles")
    assert len(report.piles) == 3
    assert report.total.volume_m3 == pytest.approx(taken("three-piles").volume_m3, rel=0.02)


def test_a_bare_floor_has_no_pile_and_a_warning_says_so() -> None:
    report = measured("bare-floor")
    assert not report.piles
    assert any("no pile was found" in warning for warning in report.warnings)


def test_a_box_is_no_pile() -> None:
    report = measured("sharp-box")
    assert not report.piles
    assert report.other_objects[0].reason == "steep sides"
    assert any("no pile was found" in warning for warning in report.warnings)


def test_the_seed_of_the_measurement_hardly_matters() -> None:
    volumes = [
        divespot.measure(taken("shape-05").points, seed=seed).piles[0].volume_m3
        for seed in range(3)
    ]
    assert np.ptp(volumes) < 0.01 * np.mean(volumes)


def test_a_flank_that_nobody_saw_is_within_its_uncertainty() -> None:
    truth, pile = taken("one-side").volume_m3, measured("one-side").piles[0]
    assert pile.volume_m3 == pytest.approx(truth, rel=0.1)
    assert abs(pile.volume_m3 - truth) < pile.u95_m3
    assert 0.6 < pile.seen_fraction < 0.9
    assert pile.budget.filled_m3 > 0.0


@pytest.mark.parametrize(
    ("kept", "within"),
    [(0.015, 0.02), (0.004, 0.03), (0.001, 0.08)],
)
def test_few_points_are_enough(kept: float, within: float) -> None:
    points = taken("shape-17").points
    chosen = np.random.default_rng(5).choice(
        len(points), round(10 * kept * len(points)), replace=False
    )
    report = divespot.measure(points[chosen])
    assert report.settings.stages.surface == "triangles"
    truth = taken("shape-17").volume_m3
    assert report.piles[0].volume_m3 == pytest.approx(truth, rel=within)
