"""Each named scene shows what its name says."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from divespot.simulate import GROUND, NAMES, STRAY, THING, SimulatedScan, scan, scene_named
from divespot.simulate.terrain import terrain
from divespot.simulate.varied import REACH, VARIED

FEW_BODIES = ("body-01", "body-17")
TRIED = [name for name in NAMES if not name.startswith("body-") or name in FEW_BODIES]


@cache
def taken(name: str) -> SimulatedScan:
    return scan(name, seed=1, density=0.02)


@pytest.mark.parametrize("name", TRIED)
def test_scene_gives_points_and_truth(name: str) -> None:
    one = taken(name)
    few = name == "scan-few"
    assert (500 if few else 2000) < len(one.points) < 60000
    assert np.all(np.isfinite(one.points))
    assert one.points.dtype == np.float64
    assert len(one.volumes_m3) == len(one.scene.piles)
    assert all(np.isfinite(v) and v > 0 for v in one.volumes_m3)
    for number in range(1, len(one.volumes_m3) + 1):
        assert np.count_nonzero(one.labels == number) > 50
    assert np.count_nonzero(one.labels == GROUND) > (300 if few else 500)


@pytest.mark.parametrize("name", TRIED)
def test_volumes_are_as_asked_unless_piles_touch(name: str) -> None:
    one = taken(name)
    asked = [pile.volume_m3 for pile in one.scene.piles]
    exact = 0.1 if name.endswith(("touching-piles", "-touching")) else 1e-9
    np.testing.assert_allclose(one.volumes_m3, asked, rtol=exact)


def test_shapes_differ_from_one_another_at_one_seed() -> None:
    heights = [taken(f"shape-{i:02d}").surface.height_m.max() for i in range(1, 10)]
    assert len(set(heights)) == 9


def test_the_big_wall_outnumbers_the_floor() -> None:
    labels = taken("big-wall").labels
    assert np.count_nonzero(labels == THING) > 1.3 * np.count_nonzero(labels == GROUND)


def test_strays_are_8_percent() -> None:
    labels = taken("strays").labels
    assert np.mean(labels == STRAY) == pytest.approx(0.08, abs=1e-3)


def test_the_optical_frame_looks_along_z() -> None:
    one = taken("optical-frame")
    seen = one.points[np.any(one.points != 0, axis=1) & (one.labels >= GROUND)]
    assert np.all(seen[:, 2] > 0)
    # All lie within the opening angles, so the lens is the origin.
    opening = np.tan(np.radians([65.0, 75.0]) / 2)
    assert np.all(np.abs(seen[:, :2]) < opening * seen[:, 2:] + 0.02)
    assert one.up[1] < 0
    assert one.up[2] < 0


def test_upside_down_has_up_downwards() -> None:
    assert taken("upside-down").up[2] < -0.9


def test_the_wavering_floor_departs_by_6_mm() -> None:
    assert np.abs(taken("wavering-floor").surface.ground_m).max() == pytest.approx(0.006)


def test_the_folded_floor_has_two_planes_3_degrees_apart() -> None:
    ground_m = taken("folded-floor").surface.ground_m[0]
    slopes = np.diff(ground_m) / taken("folded-floor").surface.node_m
    assert slopes[0] == 0
    assert np.degrees(np.arctan(slopes[-1])) == pytest.approx(3.0)


def test_the_step_lies_under_the_pile() -> None:
    surface = taken("stepped-floor").surface
    assert np.ptp(surface.ground_m) == pytest.approx(0.03)
    levels = surface.ground_m[surface.owner == 1]
    assert np.ptp(levels) == pytest.approx(0.03)


def test_the_bay_s_pile_leans_on_its_back_wall() -> None:
    one = taken("bay")
    assert one.in_scene()[one.labels == 1, 1].max() > 0.74


def test_one_side_hides_the_far_flank() -> None:
    one = taken("one-side")
    surface = one.surface
    own = one.in_scene()[one.labels == 1]
    rows, columns = np.nonzero(surface.owner)
    middle_m = surface.y[rows][surface.height_m[rows, columns].argmax()]
    line = own[np.abs(own[:, 0]) < 0.1]
    hidden = (line[:, 1] > middle_m + 0.08) & (line[:, 1] < surface.y[rows].max() - 0.08)
    assert np.mean(hidden) < 0.02


def test_the_yard_lies_in_utm_coordinates() -> None:
    one = taken("utm-yard")
    assert np.all(np.abs(one.points.mean(axis=0) - [482310, 5456790, 312]) < 20)
    _, columns = np.nonzero(one.surface.owner == 1)
    assert 25 < np.ptp(one.surface.x[columns]) < 36
    assert 5 < one.surface.height_m.max() < 12


@pytest.mark.parametrize(("name", "width_m"), [("heap-10cm", 0.1), ("grain-2m", 2.0)])
def test_heaps_are_as_wide_as_they_are_called(name: str, width_m: float) -> None:
    rows, columns = np.nonzero(taken(name).surface.owner)
    surface = taken(name).surface
    spans = np.ptp(surface.x[columns]), np.ptp(surface.y[rows])
    assert np.mean(spans) == pytest.approx(width_m, rel=0.1)


@pytest.mark.parametrize("name", VARIED)
def test_what_the_seed_draws_has_room(name: str) -> None:
    sizes_m = []
    for seed in range(2, 6):
        scene = scene_named(name, seed)
        coarse = replace(scene, floor=replace(scene.floor, node_m=2 * scene.floor.node_m))
        surface, volumes_m3 = terrain(coarse, seed)
        for number, pile in enumerate(scene.piles, start=1):
            rows, columns = np.nonzero(surface.owner == number)
            slope = np.tan(np.radians(pile.repose_deg))
            size_m = (3 * pile.volume_m3 / np.pi / slope) ** (1 / 3)
            sizes_m.append(size_m)
            x, y = surface.x[columns] - pile.center_m[0], surface.y[rows] - pile.center_m[1]
            assert max(np.abs(x).max(), np.abs(y).max()) < REACH * size_m
            # Most of a pile that touches others is still its own.
            assert 0.7 * pile.volume_m3 < volumes_m3[number - 1] < 1.001 * pile.volume_m3
    assert max(sizes_m) > 2 * min(sizes_m)


@pytest.mark.parametrize("name", sorted(set(VARIED) - {"varied-one-side"}))
def test_what_the_seed_draws_is_seen(name: str) -> None:
    one = taken(name)
    surface = one.surface
    for number in range(1, len(one.volumes_m3) + 1):
        own = one.in_scene()[one.labels == number, :2]
        rows, columns = np.nonzero(surface.owner == number)
        seen_m, true_m = np.ptp(own, axis=0), [np.ptp(surface.x[columns]), np.ptp(surface.y[rows])]
        assert (seen_m > 0.75 * np.array(true_m)).all()
