"""The ground: which plane it is, and what form it has."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import Report
from divespot.simulate import SimulatedScan, scan

if TYPE_CHECKING:
    from slow import Floats

THIN = 0.05
"""Share of a scene's points at which the ground is still beyond doubt."""
CLEAR = 0.1
"""Share at which the ring around a pile shows a fold or a step."""


@cache
def taken(name: str, density: float) -> SimulatedScan:
    return scan(name, density=density)


@cache
def measured(name: str, density: float) -> Report:
    return divespot.measure(taken(name, density).points)


def turned(points: Floats, seed: int) -> tuple[Floats, Floats]:
    """Turn a scan by any rotation; return it with the rotation."""
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    rotation *= np.linalg.det(rotation)
    return points @ rotation.T, rotation


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "name", ["bay", "sharp-box", "one-side", "optical-frame", "three-piles", "shape-05"]
)
def test_a_scan_may_lie_in_any_way(name: str, seed: int) -> None:
    truth, report = taken(name, THIN), measured(name, THIN)
    points, rotation = turned(truth.points[np.isfinite(truth.points).all(axis=1)], seed)
    found = divespot.measure(points, seed=seed)
    assert np.dot(rotation @ truth.up, found.ground.normal) > np.cos(np.radians(1.0))
    # A turned camera frame gets other cells where its extent is nearly square.
    assert [pile.volume_m3 for pile in found.piles] == pytest.approx(
        [pile.volume_m3 for pile in report.piles], rel=0.02
    )


@pytest.mark.parametrize("seed", range(3))
def test_a_wall_with_more_points_than_the_floor_may_lie_in_any_way(seed: int) -> None:
    truth = taken("big-wall", CLEAR)
    points, rotation = turned(truth.points, seed)
    report = divespot.measure(points, seed=seed)
    assert np.dot(rotation @ truth.up, report.ground.normal) > np.cos(np.radians(1.0))


def test_a_wall_with_more_points_than_the_floor_is_not_the_ground() -> None:
    truth, report = taken("big-wall", CLEAR), measured("big-wall", CLEAR)
    assert len(report.piles) == 1
    assert report.piles[0].volume_m3 == pytest.approx(truth.volume_m3, rel=0.02)


def test_a_given_up_beats_what_the_scan_says() -> None:
    truth = taken("big-wall", THIN)
    _, wall, _ = (truth.pose[:3, :3] @ np.diag([1.0, -1.0, 1.0])).T
    report = divespot.measure(truth.points, up=",".join(map(str, wall)))
    assert np.dot(wall, report.ground.normal) > np.cos(np.radians(1.0))


@pytest.mark.parametrize("name", ["wavering-floor", "folded-floor", "stepped-floor"])
def test_an_uneven_floor_is_no_pile_and_takes_nothing_from_one(name: str) -> None:
    truth, report = taken(name, CLEAR), measured(name, CLEAR)
    assert len(report.piles) == 1
    assert report.piles[0].volume_m3 == pytest.approx(truth.volume_m3, rel=0.04)


def test_the_roughness_is_that_of_the_floor_about_its_surface() -> None:
    flat, folded = measured("shape-10", CLEAR), measured("folded-floor", CLEAR)
    assert folded.ground.roughness_m == pytest.approx(flat.ground.roughness_m, rel=1.0)
