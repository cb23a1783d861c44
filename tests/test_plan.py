"""The plan: its coordinates, its labels, and what was not seen."""

from __future__ import annotations

import dataclasses
import itertools
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import Report
from divespot.results.drawn_fill import filled, thinned
from divespot.results.plan_frame import PlanFrame
from divespot.simulate import Pose, scan, scene_named

pytest.importorskip("matplotlib")

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UTM = (482_310.0, 5_456_790.0, 312.0)


@cache
def measured(unit: str = "m") -> Report:
    scale = {"m": 1.0, "mm": 0.001}[unit]
    pose = Pose(4.0, -2.0, 40.0, UTM)
    scene = dataclasses.replace(scene_named("three-piles", 0), unit_m=scale, pose=pose)
    return divespot.measure(scan(scene, density=0.05).points, unit=unit)


def axes_of(report: Report) -> Axes:
    return report.plot().axes[0]


def labels(axes: Axes) -> list[Any]:
    return [text for text in axes.texts if ": 0.0" in text.get_text()]


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_outlines_lie_where_the_report_says(unit: str) -> None:
    report = measured(unit=unit)
    lines = axes_of(report).get_lines()[:3]
    for line, pile in zip(lines, report.piles, strict=True):
        drawn = np.column_stack(line.get_data())[:-1]
        np.testing.assert_allclose(drawn, np.array(pile.outline_m)[:, :2], rtol=1e-12)


def test_the_map_lies_below_its_outlines() -> None:
    report, frame = measured(), PlanFrame.of(measured())
    above = report.level.height_map.heights_m - report.level.base_m
    for pile in report.piles:
        at = np.linalg.solve(frame.matrix[:, :2], pile.centroid_m[:2] - frame.matrix[:, 2])
        column, row = np.floor(at).astype(int)
        assert 0.3 * pile.max_height_m < above[row, column] < 1.1 * pile.max_height_m
        x, y = frame.matrix @ (*at, 1.0)
        assert (x, y) == pytest.approx(pile.centroid_m[:2], rel=1e-12)


def test_a_scan_from_the_side_is_drawn_in_the_level_frame() -> None:
    upright = scan("three-piles", density=0.05).points
    report = divespot.measure(upright[:, [2, 0, 1]], up="x")
    assert not PlanFrame.of(report).is_scan
    x, y = axes_of(report).get_lines()[0].get_data()
    assert np.max(x) < 5.0
    assert np.min(y) >= -0.1


def test_each_pile_has_its_volume_on_it_and_none_hides_another() -> None:
    report = measured()
    # The same pile nine times over: all labels want one place.
    many = dataclasses.replace(
        report,
        piles=report.piles[:1] * 9,
        scene=dataclasses.replace(report.level, outlines=report.level.outlines[:1] * 9),
    )
    for one in (report, many):
        figure = one.plot()
        found = labels(figure.axes[0])
        assert len(found) == len(one.piles)
        figure.canvas.draw()
        boxes = [text.get_bbox_patch().get_window_extent() for text in found]
        assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
        inside = figure.axes[0].get_window_extent()
        assert all(inside.contains(*box.min) and inside.contains(*box.max) for box in boxes)
    assert "±" in labels(axes_of(report))[0].get_text()
    assert "±" not in found[0].get_text(), "of many piles the table tells it"


def test_what_was_not_seen_is_hatched() -> None:
    report = measured()
    gaps = report.level.height_map.heights_m.copy()
    gaps[:5] = np.nan
    for heights, hatched in ((gaps, True), (filled(gaps), False)):
        grid = dataclasses.replace(report.level.height_map, heights_m=heights)
        scene = dataclasses.replace(report.level, closed_map=grid)
        axes = axes_of(dataclasses.replace(report, scene=scene))
        assert any(patch.get_hatch() for patch in axes.patches) == hatched
        image = axes.images[0].get_array()
        assert image is not None
        assert ((image[..., 3] == 0) == np.isnan(heights)).all()


def test_gaps_are_filled_between_what_was_seen() -> None:
    x, y = np.meshgrid(np.arange(40.0), np.arange(33.0))
    plane = 2.0 * x - y
    gaps = plane.copy()
    gaps[5:20, 8:30] = np.nan
    whole = filled(gaps)
    assert np.array_equal(whole[~np.isnan(gaps)], plane[~np.isnan(gaps)])
    assert np.nanmin(gaps) <= whole.min() <= whole.max() <= np.nanmax(gaps)
    assert np.abs(whole - plane)[5:20, 8:30].mean() < 8.0
    assert np.isnan(filled(np.full((4, 4), np.nan))).all()
    assert np.array_equal(
        thinned(plane[:32], 2), plane[:32].reshape(16, 2, 20, 2).mean(axis=(1, 3))
    )


def test_a_map_in_a_reference_system_points_north() -> None:
    report = measured()
    assert PlanFrame.of(report).up_arrow == "y"
    source = dataclasses.replace(report.source, crs="EPSG:25832")
    assert PlanFrame.of(dataclasses.replace(report, source=source)).up_arrow == "N"
    assert any(
        t.get_text() == "N" for t in axes_of(dataclasses.replace(report, source=source)).texts
    )


def test_a_scan_without_piles_is_drawn_too() -> None:
    x, y = np.meshgrid(np.arange(60) * 0.01, np.arange(60) * 0.01)
    z = np.random.default_rng(0).normal(0.0, 0.0005, x.shape)
    report = divespot.measure(np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    assert axes_of(report).get_title(loc="left") == "no pile found"
