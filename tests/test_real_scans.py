"""Real scans, with no option given."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import DivespotError, Settings
from divespot.intake import load
from divespot.io import read
from reports import objects

if TYPE_CHECKING:
    from numpy.typing import NDArray

Find = Callable[[str], Path]


def test_a_cardboard_box_before_a_tilted_camera(real_scan: Find) -> None:
    report = divespot.measure(real_scan("kinectv2_box_1.ply"))
    close = [o for o in objects(report) if o.volume_m3 == pytest.approx(0.0303, rel=0.08)]
    assert len(close) == 1
    assert close[0] == max(objects(report), key=lambda o: o.volume_m3)
    # The haze behind it is no pile.
    assert not report.piles
    assert report.source.dropped_zero == 15_081
    assert report.ground.tilt_deg > 30


def test_a_stockpile_on_a_yard(real_scan: Find) -> None:
    report = divespot.measure(real_scan("uav_pile_id10_crop.npy"))
    assert 79 / 1.08 <= report.piles[0].volume_m3 <= 86 * 1.08


def test_pixels_without_a_depth_are_no_ground(real_scan: Find) -> None:
    path = real_scan("livox_full_bin_with_zero_points.ply")
    source = load(path, Settings()).source
    assert (source.points, source.dropped_zero) == (360_270, 243_517)
    # Of the floor around the bin next to nothing is in view: no confident number may be given.
    try:
        piles = divespot.measure(path).piles
    except DivespotError as error:
        assert "no ground is in view" in str(error)  # noqa: PT017 - or a report
    else:
        assert all(pile.u95_m3 > 0.3 * pile.volume_m3 for pile in piles)


def around(path: Path) -> dict[str, Any]:
    """Return the rectangle around a scan in plan, as GeoJSON."""
    x, y, _ = read(path).points.T
    x0, x1, y0, y1 = x.min(), x.max(), y.min(), y.max()
    line = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    return {"type": "Polygon", "coordinates": [line]}


@pytest.mark.parametrize(("part", "litres"), [(25, 4.15), (50, 7.33), (75, 11.13), (100, 15.0)])
def test_a_box_of_balls_without_a_floor_in_view(real_scan: Find, part: int, litres: float) -> None:
    path = real_scan(f"livox_balls_{part}.ply")
    report = divespot.measure(path, outline=around(path), base="height=-2.094", up="z")
    (pile,) = report.piles
    truth_m3 = litres / 1000
    assert abs(pile.volume_m3 - truth_m3) < max(pile.u95_m3, 0.035 * truth_m3)
    assert report.ground.normal == (0, 0, 1)


@pytest.mark.parametrize(("part", "litres"), [(25, 4.15), (100, 15.0)])
def test_a_thinned_box_of_balls(part: int, litres: float) -> None:
    path = Path(__file__).parent / "data" / f"balls_{part}.laz"
    report = divespot.measure(path, outline=around(path), base="height=-2.094", up="z")
    (pile,) = report.piles
    assert abs(pile.volume_m3 - litres / 1000) < min(pile.u95_m3, 0.1 * litres / 1000)


def test_a_table_top_with_two_fifths_missing(real_scan: Find) -> None:
    report = divespot.measure(real_scan("mosd_test0.pcd"))
    assert report.source.points == 640 * 480
    assert 0.3 < report.source.dropped_nonfinite / report.source.points < 0.5
    # Things on a table: a few litres, not the table.
    assert all(found.volume_m3 < 0.02 for found in objects(report))


@pytest.mark.parametrize(
    "name",
    [
        "autzen_trim.laz",
        "kinectv2_box_1.ply",
        "livox_balls_25.ply",
        "livox_balls_100.ply",
        "livox_full_bin_with_zero_points.ply",
        "lone-star.laz",
        "mosd_test0.pcd",
        "mvk-thin.las",
        "unitree_package1.pcd",
        "unitree_package2.pcd",
    ],
)
def test_every_scan_ends_in_a_report_or_one_sentence(real_scan: Find, name: str) -> None:
    try:
        report = divespot.measure(real_scan(name))
    except DivespotError as error:
        assert "\n" not in str(error)  # noqa: PT017 - the only error there may be
    else:
        assert report.piles or report.warnings
        assert json.loads(report.to_json())["source"]["path"].endswith(name)
        assert all(found.volume_m3 == found.cut_m3 - found.fill_m3 for found in objects(report))


def test_copc_holds_the_points_of_laz(real_scan: Find) -> None:
    one, other = (read(real_scan(f"lone-star.{kind}")) for kind in ("laz", "copc.laz"))
    np.testing.assert_allclose(in_order(other.points), in_order(one.points), rtol=0, atol=1e-8)


def in_order(points: NDArray[np.float64]) -> NDArray[np.float64]:
    whole = np.round(points / 0.00025)  # steps of both files
    return points[np.lexsort(whole.T)]
