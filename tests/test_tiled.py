"""Surveys measured window by window: as in memory, every pile once, the same bits whatever came."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import laspy
import numpy as np
import pytest

import divespot.blocks
import divespot.one_pass
import divespot.pipeline
import divespot.streaming
import divespot.tiled
import divespot.too_large
import divespot.windows
from divespot import DivespotError, measure
from divespot.accumulator import Accumulator
from divespot.blocks import Blocks
from test_streaming import CORNER_M, volume_m3, write_las

if TYPE_CHECKING:
    from pathlib import Path

    from divespot import Report

#: Radius and rise of cones, and their middles, on 24 by 16 m: the first lies across all tiles, the
#: second across a border, the others are narrower than the cells of the whole survey.
CONES = (
    (5.0, 0.6, 10.0, 8.0),
    (1.5, 0.6, 18.0, 12.0),
    (0.6, 0.6, 2.0, 2.0),
    (0.6, 0.6, 17.5, 3.0),
    (0.6, 0.6, 22.5, 7.5),
)
#: A window moves a volume by less than this share of its u95.
SHARE = 0.5


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0.0, 1.0, (2, 200_000)) * np.array([[24.0], [16.0]])
    z = rng.normal(0.0, 0.01, 200_000)
    for radius, rise, x0, y0 in CONES:
        z += rise * np.maximum(0.0, radius - np.hypot(x - x0, y - y0))
    return write_las(tmp_path_factory.mktemp("yard") / "yard.laz", np.column_stack([x, y, z]))


@pytest.fixture
def tiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hold the survey in voxels of half a metre, and measure it in tiles of 9 m."""
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", 100_000)
    monkeypatch.setattr(divespot.streaming, "AIMED_VOXELS", 1_500)
    monkeypatch.setattr(divespot.windows, "TILE", 200)
    for module in (divespot.windows, divespot.tiled):
        monkeypatch.setattr(module, "AROUND", 30)


@pytest.fixture(scope="module")
def whole(scene: Path) -> Report:
    return measure(scene)


def holds_each_once(report: Report) -> bool:
    at = [np.subtract(pile.centroid_m[:2], CORNER_M[:2]) for pile in report.piles]
    near = [min(math.dist(place, cone[2:]) for place in at) for cone in CONES]
    return len(report.piles) == len(CONES) and max(near) < 0.2


@pytest.mark.usefixtures("tiled")
def test_cells_as_wide_as_those_of_the_whole_need_no_windows(scene: Path) -> None:
    coarse, fine = measure(scene, cell_m=1.1), measure(scene, cell_m=0.2)
    told = ["part by part" in " ".join(report.warnings) for report in (coarse, fine)]
    assert told == [False, True]
    large = coarse.piles[0]
    assert abs(large.volume_m3 - volume_m3(*CONES[0][:2])) < large.u95_m3


@pytest.mark.usefixtures("tiled")
def test_windows_show_each_pile_once_and_as_the_whole_scan_does(
    scene: Path, whole: Report, monkeypatch: pytest.MonkeyPatch
) -> None:
    stages: list[str] = []
    report = measure(scene, on_stage=stages.append)
    assert holds_each_once(whole)
    assert holds_each_once(report)
    windows = sum(stage.startswith("windows, ") for stage in stages)
    assert windows > 6  # tiles, and one for the cone that is too large for them
    (told,) = (told for told in report.warnings if "piles were measured" in told)
    assert "on voxels of 0.048 m" in told
    for one, other, cone in zip(whole.piles, report.piles, CONES, strict=False):
        assert abs(other.volume_m3 - volume_m3(*cone[:2])) < other.u95_m3
        assert abs(one.volume_m3 - other.volume_m3) < SHARE * one.u95_m3
        assert 0.5 < other.u95_m3 / one.u95_m3 < 2.0
    assert len(report.level.outlines) == len(report.piles)
    monkeypatch.setattr(divespot.pipeline, "blocks_of", lambda *_: None)
    assert not holds_each_once(measure(scene))


@pytest.mark.usefixtures("tiled")
def test_order_chunks_and_threads_change_no_bit_of_what_windows_hold(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = divespot.streaming.planned([str(scene)], divespot.Settings())
    las = laspy.read(scene)
    las.points = las.points[np.random.default_rng(1).permutation(len(las.points))]
    las.write(tmp_path / "mixed.las")
    monkeypatch.setattr("divespot.io.las_stretches.STRETCH", 17_000)
    monkeypatch.setattr(divespot.one_pass, "AT_ONCE", 10_000)
    monkeypatch.setattr(divespot.blocks, "WAITING", 100_000)
    mixed = divespot.streaming.planned([str(tmp_path / "mixed.las")], divespot.Settings())
    held = []
    for stretches, threads in ((plan.stretches, 1), (mixed.stretches[::-1], 3)):
        blocks = plan.way.blocks()
        assert blocks is not None
        own = divespot.one_pass.Plan(stretches, plan.way, plan.sample)
        divespot.streaming.read(own, threads, blocks)
        held.append({at: blocks.load([at]).to_bytes() for at in blocks.places()})
    assert held[0] == held[1]


def test_voxels_are_as_wide_as_points_are_apart_in_whatever_order(tmp_path: Path) -> None:
    x, y = np.random.default_rng(0).uniform(0.0, 50.0, (2, 600_000))
    floor = np.column_stack([x, y, np.zeros(len(x))])
    rows = floor[np.lexsort((x, np.floor(y / 0.5)))]
    expected = 1.1 * 50.0 / math.sqrt(len(x))
    for name, points in (("rows", rows), ("mixed", floor)):
        path = str(write_las(tmp_path / f"{name}.laz", points))
        way = divespot.streaming.planned([path], divespot.Settings()).way
        assert way.voxel_m == pytest.approx(expected, rel=0.1)


@pytest.mark.usefixtures("tiled")
def test_outlines_are_windows(scene: Path) -> None:
    x, y, _ = CORNER_M
    inside = (x + 15.0, y + 9.0, x + 21.0, y + 15.0)
    (pile,) = measure(scene, inside=inside).piles
    assert abs(pile.volume_m3 - volume_m3(*CONES[1][:2])) < pile.u95_m3 < 0.2


@pytest.mark.usefixtures("tiled")
def test_what_was_not_found_in_the_whole_is_measured_in_a_wider_window(
    scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    windows = divespot.tiled._windows  # nothing is known of the large cone
    monkeypatch.setattr(divespot.tiled, "_windows", lambda whole, _: windows(whole, []))
    report = measure(scene)
    assert holds_each_once(report)
    assert abs(report.piles[0].volume_m3 - volume_m3(*CONES[0][:2])) < report.piles[0].u95_m3


@pytest.mark.usefixtures("tiled")
def test_lengths_that_are_given_are_for_the_windows(scene: Path) -> None:
    crop = (*np.add(CORNER_M, -1.0), *np.add(CORNER_M, 14.0))
    report = measure(scene, cell_m=0.2, radius_m=0.15, crop=crop)
    assert (report.settings.cell_m, report.settings.radius_m) == (0.2, 0.15)


def test_of_more_voxels_than_are_held_the_edges_are_doubled() -> None:
    nothing = Accumulator(0.1, most=1000)
    blocks = Blocks(nothing, (0.0, 0.0, 0.0))
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (5000, 3)) * (1.0, 1.0, 0.0)
    expected = nothing.empty()
    expected.add(points)
    for some in np.array_split(points, 9):
        part = Accumulator(0.1, most=1000)
        part.add(some)
        blocks.put(part.blocks())
    found = blocks.load(blocks.places())
    assert found.voxel_m > 0.1
    assert found.to_bytes() == expected.to_bytes()
    corners = blocks.corners_m(blocks.places())
    assert (corners.min(axis=(0, 1)) <= points.min(axis=0)).all()
    assert (corners.max(axis=(0, 1)) >= points.max(axis=0)).all()


def test_a_full_disk_is_one_sentence_and_nothing_is_left() -> None:
    blocks = Blocks(Accumulator(0.1), (0.0, 0.0, 0.0))
    folder = blocks._folder
    part = Accumulator(0.1)
    part.add([[1.0, 1.0, 1.0]])
    blocks.put(part.blocks())
    folder.rmdir()
    with pytest.raises(DivespotError, match=r"cannot be kept there \(No such file.*TMPDIR"):
        blocks.load(blocks.places())
    folder = Blocks(Accumulator(0.1), (0.0, 0.0, 0.0))._folder
    assert not folder.exists()
