"""Piles found without help: touching ones parted, what is no pile kept out of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import divespot
from divespot import Report
from divespot.simulate import SimulatedScan, scan, scene_named
from divespot.simulate.scene import Pile, Scene
from divespot.simulate.shapes import RAIL_CAMERAS
from divespot.simulate.things import Box, Person, Rod, Thing, Wall

FEW = 0.1
"""Share of a scene's points: seconds become tenths of a second."""
FOOT_M = 0.4
"""From the middle of the pile below to its foot, across the strip."""
HEAP = Pile(0.028, peaks=3, spread=0.4, heading_deg=0.0)


@cache
def beside(*things: Thing, seed: int = 0) -> tuple[SimulatedScan, Report]:
    """Scan one pile with things around it."""
    plain = scene_named("shape-10", seed)
    scene = replace(plain, piles=(HEAP,), things=things, name="things")
    taken = scan(scene, seed=seed, density=FEW)
    return taken, divespot.measure(taken.points)


def check_only_pile(taken: SimulatedScan, report: Report, within: float = 0.02) -> None:
    assert len(report.piles) == 1
    assert report.piles[0].volume_m3 == pytest.approx(taken.volume_m3, rel=within)


@pytest.mark.parametrize("seed", range(3))
def test_touching_piles_are_parted_along_the_valley(seed: int) -> None:
    taken = scan("touching-piles", seed=seed, density=FEW)
    report = divespot.measure(taken.points)
    found = [pile.volume_m3 for pile in report.piles]
    assert found == pytest.approx(sorted(taken.volumes_m3, reverse=True), rel=0.04)
    assert report.total.volume_m3 == pytest.approx(taken.volume_m3, rel=0.02)


def test_touching_piles_are_parted_however_the_scan_is_turned() -> None:
    taken = scan("touching-piles", seed=0, density=FEW)
    for turn_deg in (30.0, 45.0, 77.0):
        angle = np.radians(turn_deg)
        cos, sin = np.cos(angle), np.sin(angle)
        turned = taken.points @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
        found = [pile.volume_m3 for pile in divespot.measure(turned).piles]
        assert found == pytest.approx(sorted(taken.volumes_m3, reverse=True), rel=0.04)


@pytest.mark.parametrize("seed", range(3))
def test_lobes_of_one_pile_stay_together(seed: int) -> None:
    pile = Pile(0.06, peaks=3, spread=0.7)
    scene = replace(scene_named("grain-2m", seed), piles=(pile,), things=(), name="lobes")
    taken = scan(scene, seed=seed, density=0.05)
    check_only_pile(taken, divespot.measure(taken.points))


@pytest.mark.parametrize("seed", range(3))
def test_a_pile_in_a_bay_leans_on_its_walls(seed: int) -> None:
    taken = scan("bay", seed=seed, density=FEW)
    report = divespot.measure(taken.points)
    check_only_pile(taken, report, within=0.03)
    assert report.piles[0].leans_on_wall
    assert not report.piles[0].touches_edge


def narrow_bay() -> Scene:
    walls = (
        Wall((-0.6, 0.8), (0.6, 0.8), 0.8, leaned_on=True),
        Wall((-0.55, -0.8), (-0.55, 0.8), 0.8, leaned_on=True),
        Wall((0.55, -0.8), (0.55, 0.8), 0.8, leaned_on=True),
    )
    pile = Pile(0.08, (0.0, 0.5), heading_deg=0.0)
    camera = replace(RAIL_CAMERAS[2.6], rail_m=0.6, frames=4)
    plain = scene_named("bay")
    return replace(plain, piles=(pile,), things=walls, camera=camera, name="narrow")


def test_a_pile_between_three_walls_is_a_pile() -> None:
    taken = scan(narrow_bay(), density=FEW)
    report = divespot.measure(taken.points)
    check_only_pile(taken, report, within=0.04)
    assert report.piles[0].leans_on_wall


def test_a_wall_beside_a_pile_is_not_of_it() -> None:
    taken, report = beside(Wall((-1.2, FOOT_M + 0.15), (1.2, FOOT_M + 0.15)))
    check_only_pile(taken, report)
    assert not report.piles[0].leans_on_wall


def test_a_box_beside_a_pile_is_another_object() -> None:
    taken, report = beside(Box((0.0, FOOT_M + 0.25), (0.3, 0.25, 0.3), 20.0))
    check_only_pile(taken, report)
    assert "steep sides" in [other.reason for other in report.other_objects]


def test_a_rod_at_the_foot_of_a_pile_is_not_of_it() -> None:
    check_only_pile(*beside(Rod((0.0, -FOOT_M - 0.03), 0.015)))


def test_a_person_at_the_foot_of_a_pile_is_not_of_it() -> None:
    frames = tuple(range(6))
    check_only_pile(*beside(Person((0.0, -FOOT_M - 0.25), (0.0, 0.0), frames)))


def test_a_rod_in_a_pile_is_closed() -> None:
    plain = scene_named("shape-10", 0)
    taken = scan(replace(plain, piles=(HEAP,), things=(), name="rod"), seed=0, density=FEW)
    rng = np.random.default_rng(0)
    turn, up_m = rng.uniform(0, 2 * np.pi, 300), rng.uniform(0.0, 1.2, 300)
    rod = np.column_stack([0.1 + 0.02 * np.cos(turn), 0.05 + 0.02 * np.sin(turn), up_m])
    placed = rod @ taken.pose[:3, :3].T + taken.pose[:3, 3]
    report = divespot.measure(np.concatenate([taken.points, placed]))
    check_only_pile(taken, report)


@pytest.mark.parametrize("seed", range(3))
def test_a_box_has_its_volume(seed: int) -> None:
    taken = scan("sharp-box", seed=seed, density=0.3)
    report = divespot.measure(taken.points)
    assert not report.piles
    assert report.other_objects[0].volume_m3 == pytest.approx(0.45 * 0.36 * 0.19, rel=0.04)
