"""Differences from an earlier scan or a given height, without ground in view: closed forms."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import Report
from divespot.differences import TOO_LITTLE
from divespot.io import write
from divespot.simulate import scan, scene_named

if TYPE_CHECKING:
    from pathlib import Path

    from solids import Floats

NOISE_M = 0.002

#: Seeds of the noise, and heights of a floor before and after.
LEVELS = ((5, 0.0), (6, 0.3))


def cone(x: Floats, y: Floats, at: tuple[float, float], radius: float, height: float) -> Floats:
    return np.clip(height * (1 - np.hypot(x - at[0], y - at[1]) / radius), 0, None)


def cone_m3(radius: float, height: float) -> float:
    return float(np.pi * radius**2 * height / 3)


def plan(seed: int, half: tuple[float, float], count: int) -> tuple[Floats, Floats]:
    x, y = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, 2)).T * np.array([half]).T
    return x, y


def noisy(seed: int, *parts: Floats) -> Floats:
    points = np.concatenate(parts)
    return np.asarray(points + np.random.default_rng(seed).normal(0, NOISE_M, points.shape))


def walls(low: float, high: float, half: tuple[float, float]) -> Floats:
    """Return four walls around a bin."""
    (a, b), rng = half, np.random.default_rng(7)
    along, up = rng.uniform(-1, 1, 16_000), rng.uniform(low, high, 16_000)
    side = np.arange(16_000) % 4
    x = np.choose(side, [np.full(16_000, -a), np.full(16_000, a), a * along, a * along])
    y = np.choose(side, [b * along, b * along, np.full(16_000, -b), np.full(16_000, b)])
    return np.column_stack([x, y, up])


def against(folder: Path, later: Floats, earlier: Floats) -> Report:
    write(folder / "earlier.ply", earlier)
    return divespot.measure(later, base=f"surface={folder / 'earlier.ply'}")


def yard(seed: int, *cones: tuple[tuple[float, float], float, float]) -> Floats:
    x, y = plan(seed, (3.0, 3.0), 90_000)
    z = sum((np.sign(h) * cone(x, y, at, r, abs(h)) for at, r, h in cones), 0.01 * np.sin(2 * x))
    return noisy(seed, np.column_stack([x, y, z]))


def test_what_was_lost_gained_and_filled_is_told_apart(tmp_path: Path) -> None:
    same = ((-1.5, 1.5), 0.8, 0.5)
    before = yard(
        1, ((-1.5, -1.5), 0.9, 0.5), ((1.5, -1.5), 0.5, 0.3), ((1.5, 1.5), 0.8, -0.3), same
    )
    after = yard(2, ((-1.5, -1.5), 0.9, 0.2), ((1.5, -1.5), 0.9, 0.5), same)
    report = against(tmp_path, after, before)
    truths = [
        cone_m3(0.9, 0.5) - cone_m3(0.5, 0.3),
        cone_m3(0.8, 0.3),
        cone_m3(0.9, 0.2) - cone_m3(0.9, 0.5),
    ]
    assert len(report.piles) == len(truths)
    for pile, truth in zip(report.piles, truths, strict=True):
        assert abs(pile.volume_m3 - truth) < max(pile.u95_m3, 0.01 * abs(truth))
        assert pile.u95_m3 < 0.05 * abs(truth)
    lost = report.piles[-1]
    assert lost.fill_m3 > 50 * lost.cut_m3
    assert report.warnings == ()


def test_where_nothing_changed_nothing_is_found(tmp_path: Path) -> None:
    heap = ((0.0, 0.0), 1.2, 0.7)
    report = against(tmp_path, yard(3, heap), yard(4, heap))
    assert report.piles == ()


def scanned_twice(folder: Path, name: str, share: float = 1.0) -> Report:
    """Compare a scene with itself before its first pile was reduced to a share."""
    before = scene_named(name, 1)
    first = before.piles[0]
    left = dataclasses.replace(first, volume_m3=share * first.volume_m3)
    after = dataclasses.replace(before, piles=(left, *before.piles[1:]))
    earlier, later = scan(before, density=0.1, seed=1), scan(after, density=0.1, seed=1, repeat=1)
    return against(folder, later.points, earlier.points)


SCENES = ("shape-05", "shape-11", "three-piles", "touching-piles", "wavering-floor", "utm-yard")


@pytest.mark.parametrize("name", SCENES)
def test_frames_that_lie_apart_are_no_change(name: str, tmp_path: Path) -> None:
    report = scanned_twice(tmp_path, name)
    assert report.piles == ()
    assert (report.total.volume_m3, report.status) == (0.0, "no_pile")
    assert None not in {item.reason for item in report.other_objects}


@pytest.mark.parametrize("name", ["shape-05", "three-piles", "utm-yard"])
def test_a_third_of_a_pile_that_is_gone_is_within_its_u95(name: str, tmp_path: Path) -> None:
    report = scanned_twice(tmp_path, name, share=0.7)
    (lost,) = report.piles
    truth = -0.3 * scene_named(name, 1).piles[0].volume_m3
    assert abs(lost.volume_m3 - truth) < lost.u95_m3 < 0.5 * abs(truth)


def test_measure_and_compare_know_a_change_as_well(tmp_path: Path) -> None:
    before, after = (yard(seed, ((0.0, 0.0), 1.2, height)) for seed, height in ((3, 0.7), (4, 0.5)))
    (lost,) = against(tmp_path, after, before).piles
    (place,) = divespot.compare(before, after).places
    assert place.net.volume_m3 == pytest.approx(lost.volume_m3, abs=lost.u95_m3)
    assert place.net.u95_m3 == pytest.approx(lost.u95_m3, rel=0.1)


def test_where_all_ground_changed_a_warning_says_what_u95_leaves_out(tmp_path: Path) -> None:
    x, y = plan(5, (0.7, 0.5), 40_000)
    empty, full = (noisy(seed, np.column_stack([x, y, level + 0 * x])) for seed, level in LEVELS)
    report = against(tmp_path, full, empty)
    assert report.total.volume_m3 == pytest.approx(0.3 * 1.4 * 1.0, rel=0.01)
    assert TOO_LITTLE in report.warnings


@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_a_bin_is_filled_up_to_its_walls(slope: float, tmp_path: Path) -> None:
    half = (0.7, 0.5)
    x, y = plan(5, half, 40_000)
    fill = 0.3 + slope * x + cone(x, y, (0.1, 0.0), 0.4, 0.2)
    full = noisy(5, np.column_stack([x, y, fill]), walls(0.5, 1.2, half))
    x, y = plan(6, half, 40_000)
    empty = noisy(6, np.column_stack([x, y, 0 * x]), walls(0.02, 1.2, half))
    report = against(tmp_path, full, empty)
    (pile,) = report.piles
    truth = 0.3 * 1.4 * 1.0 + cone_m3(0.4, 0.2)
    assert abs(pile.volume_m3 - truth) < max(pile.u95_m3, 0.01 * truth)
    assert pile.u95_m3 < 0.05 * truth
    emptied = against(tmp_path, empty, full)
    # Of the empty bin the walls hold most points: it is thinned, and its floor ends before them.
    assert sum(p.volume_m3 for p in emptied.piles) == pytest.approx(-truth, rel=0.03)


def test_a_pile_that_was_cut_out_stands_on_the_height_that_is_given() -> None:
    x, y = plan(8, (1.0, 1.0), 60_000)
    z = 5.0 + cone(x, y, (0.0, 0.0), 1.0, 0.6)
    inside = np.hypot(x, y) < 0.85
    points = noisy(8, np.column_stack([x, y, z]))[inside]
    (pile,) = divespot.measure(points, base="height=5", up="z").piles
    truth = np.pi * 0.85**2 * 0.6 * (1 - 0.85) + cone_m3(0.85, 0.6 * 0.85)
    assert abs(pile.volume_m3 - truth) < max(pile.u95_m3, 0.01 * truth)
    assert pile.u95_m3 < 0.1 * truth


def test_a_heap_that_fills_the_view_stands_on_the_height_that_is_given() -> None:
    x, y = plan(9, (1.0, 0.8), 60_000)
    points = noisy(9, np.column_stack([x, y, cone(x, y, (0.1, 0.0), 2.5, 1.2)]))
    (pile,) = divespot.measure(points, base="height=0", up="z").piles
    fine_x, fine_y = np.meshgrid(np.linspace(-1, 1, 801), np.linspace(-0.8, 0.8, 641))
    truth = 3.2 * cone(fine_x, fine_y, (0.1, 0.0), 2.5, 1.2).mean()
    assert abs(pile.volume_m3 - truth) < max(pile.u95_m3, 0.01 * truth)
