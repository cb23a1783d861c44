"""The report and its JSON, against the contract."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import Report, Settings
from divespot.simulate import Pose, SimulatedScan, scan, scene_named
from reports import objects

if TYPE_CHECKING:
    from slow import Floats

OFFSET_M = (482_310.0, 5_456_790.0, 312.0)
KEYS = [
    "schema",
    "divespot",
    "status",
    "source",
    "piles",
    "other_objects",
    "total",
    "ground",
    "settings",
    "seed",
    "timings_s",
    "warnings",
]
PILE_KEYS = [
    "id",
    "volume_m3",
    "u95_m3",
    "cut_m3",
    "fill_m3",
    "footprint_m2",
    "max_height_m",
    "centroid_m",
    "outline_m",
    "seen_fraction",
    "touches_edge",
    "leans_on_wall",
    "mass_kg",
    "u95_mass_kg",
    "base",
    "budget",
    "volume_by_base_m3",
    "name",
]


@cache
def taken() -> SimulatedScan:
    """Three piles in millimetres, tilted, in UTM coordinates."""
    scene = scene_named("three-piles", 0)
    pose = Pose(12.0, -7.0, 40.0, OFFSET_M)
    return scan(replace(scene, unit_m=0.001, pose=pose), density=0.1)


@cache
def measured() -> Report:
    return divespot.measure(taken().points, unit="mm", density_kg_m3=720.0, density_u_kg_m3=20.0)


@cache
def parsed() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(measured().to_json())
    return found


def in_scene(positions: Floats) -> Floats:
    """Return positions of the scan in the scene's own frame, in metres."""
    truth = taken()
    return np.asarray((positions * 0.001 - truth.pose[:3, 3]) @ truth.pose[:3, :3])


def area(line: Floats) -> float:
    """Return the signed area of a closed line."""
    x, y = line.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def inside(line: Floats, at: Floats) -> bool:
    """Tell whether a closed line goes around a place: by the angles to its corners."""
    angles = np.unwrap(np.arctan2(*(line - at).T[::-1]), axis=0)
    closing = np.angle(np.exp(1j * (angles[0] - angles[-1])))
    return bool(abs(angles[-1] + closing - angles[0]) > math.pi)


def test_the_keys_are_those_of_the_contract() -> None:
    report = parsed()
    assert list(report) == KEYS
    assert report["schema"] == "divespot.report/1"
    assert report["divespot"] == divespot.__version__
    assert set(report["source"]) == {
        *("path", "points", "dropped_nonfinite", "dropped_zero", "unit", "crs"),
        *("files", "scale_factor"),
    }
    assert set(report["total"]) == {"volume_m3", "u95_m3", "mass_kg", "u95_mass_kg"}
    assert set(report["ground"]) == {
        *("normal", "offset_m", "tilt_deg", "roughness_m", "inlier_fraction", "up_from")
    }
    for pile in report["piles"]:
        assert set(PILE_KEYS) <= set(pile)
        assert "reason" not in pile
        assert {"noise_m3", "base_m3", "footprint_m3", "filled_m3", "grid_m3"} <= set(
            pile["budget"]
        )


def test_other_objects_have_a_reason_besides() -> None:
    report = json.loads(divespot.measure(scan("sharp-box", density=0.1).points).to_json())
    assert report["piles"] == []
    assert set(PILE_KEYS) | {"reason"} <= set(report["other_objects"][0])
    assert report["other_objects"][0]["mass_kg"] is None
    assert report["total"]["volume_m3"] == report["total"]["u95_m3"] == 0
    assert report["total"]["mass_kg"] is None


def test_the_three_piles_come_largest_first() -> None:
    truth = sorted(taken().volumes_m3, reverse=True)
    assert [pile["id"] for pile in parsed()["piles"]] == [1, 2, 3]
    assert [pile["volume_m3"] for pile in parsed()["piles"]] == pytest.approx(truth, rel=0.03)


def test_volumes_are_cut_less_fill_and_masses_are_theirs() -> None:
    for pile in parsed()["piles"]:
        assert pile["volume_m3"] == pytest.approx(pile["cut_m3"] - pile["fill_m3"], rel=1e-12)
        assert pile["mass_kg"] == pytest.approx(720 * pile["volume_m3"], rel=1e-12)
        terms = math.hypot(*pile["budget"].values())
        assert pile["u95_m3"] == pytest.approx(2 * terms, rel=1e-12)
        assert 0 < pile["u95_m3"] < 0.2 * pile["volume_m3"]
        assert 0 < pile["seen_fraction"] <= 1
        assert pile["touches_edge"] is False
        assert pile["leans_on_wall"] is False


def test_the_total_adds_up_with_an_uncertainty_between_both_sums() -> None:
    piles, total = parsed()["piles"], parsed()["total"]
    assert total["volume_m3"] == pytest.approx(sum(p["volume_m3"] for p in piles), rel=1e-12)
    each = [pile["u95_m3"] for pile in piles]
    assert math.hypot(*each) * (1 - 1e-12) <= total["u95_m3"] <= sum(each) * (1 + 1e-12)


def test_positions_are_in_the_scan_s_frame_and_unit() -> None:
    surface = taken().surface
    for pile, number in zip(
        parsed()["piles"], np.argsort(taken().volumes_m3)[::-1] + 1, strict=True
    ):
        at = in_scene(np.array(pile["centroid_m"]))
        rows, columns = np.nonzero(surface.owner == number)
        height = surface.height_m[rows, columns]
        expected = [height @ surface.x[columns], height @ surface.y[rows], height @ height / 2]
        np.testing.assert_allclose(at, np.array(expected) / height.sum(), rtol=0, atol=0.01)
        assert pile["max_height_m"] == pytest.approx(height.max(), abs=0.02)
        assert pile["footprint_m2"] == pytest.approx(len(rows) * surface.node_m**2, rel=0.25)


def report_cell_m() -> float:
    return float(parsed()["settings"]["cell_m"])


def test_the_outline_lies_on_the_floor_around_the_centroid() -> None:
    for pile in parsed()["piles"]:
        line = in_scene(np.array(pile["outline_m"]))
        assert np.abs(line[:, 2]).max() < 0.01
        assert inside(line[:, :2], in_scene(np.array(pile["centroid_m"]))[:2])
        # It runs a cell outside the footprint, within the toe.
        cell_m = report_cell_m()
        footprint_m2 = pile["footprint_m2"]
        rim_m2 = 2 * cell_m * np.sqrt(np.pi * footprint_m2)
        assert footprint_m2 < area(line[:, :2]) < footprint_m2 + 2 * rim_m2


def test_the_ground_is_the_floor_in_metres_in_the_scan_s_frame() -> None:
    ground, truth = parsed()["ground"], taken()
    assert np.dot(ground["normal"], truth.up) > np.cos(np.radians(0.3))
    middle = truth.pose[:3, 3]  # the scene's origin, on its floor
    assert np.dot(ground["normal"], middle) - ground["offset_m"] == pytest.approx(0, abs=0.005)
    tilt = np.degrees(np.arccos(truth.up[2]))
    assert ground["tilt_deg"] == pytest.approx(tilt, abs=0.3)
    assert 0 < ground["roughness_m"] < 0.005
    assert 0.2 < ground["inlier_fraction"] < 1


def test_settings_are_resolved_and_the_seed_is_there() -> None:
    report = divespot.measure(taken().points, unit="mm", seed=7)
    found = json.loads(report.to_json())
    assert {name for name, value in found["settings"].items() if value is None} == {
        *("classes", "columns", "crop", "crs", "density_kg_m3", "inside", "material", "outline")
    }
    assert found["seed"] == found["settings"]["seed"] == 7
    assert found["settings"]["unit"] in ("mm", "auto")


def test_every_stage_has_its_time() -> None:
    stages: list[str] = []
    report = divespot.measure(taken().points, unit="mm", on_stage=stages.append)
    assert list(report.timings_s) == stages
    assert len(stages) == len(set(stages)) >= 10
    assert all(0 <= time < 60 for time in report.timings_s.values())


def test_the_unit_changes_positions_only() -> None:
    metres = divespot.measure(taken().points * 0.001)
    for one, other in zip(objects(metres), objects(measured()), strict=True):
        assert one.volume_m3 == pytest.approx(other.volume_m3, rel=0.01)
        np.testing.assert_allclose(np.array(one.centroid_m) * 1000, other.centroid_m, rtol=1e-8)


def test_a_crop_is_in_the_scan_s_frame_and_unit() -> None:
    (x, y, z), half = measured().piles[1].centroid_m, 450.0
    box = (x - half, y - half, z - half, x + half, y + half, z + half)
    report = divespot.measure(taken().points, unit="mm", crop=box)
    assert report.piles[0].volume_m3 == pytest.approx(measured().piles[1].volume_m3, rel=0.05)
    assert report.settings.crop == box
    assert json.loads(report.to_json())["settings"]["crop"] == list(box)


def test_what_is_not_finite_is_null() -> None:
    report = measured()
    odd = replace(report.piles[0], centroid_m=(math.nan, math.inf, -math.inf), mass_kg=math.nan)
    found = json.loads(replace(report, piles=(odd,)).to_json())["piles"][0]
    assert found["centroid_m"] == [None, None, None]
    assert found["mass_kg"] is None


def test_an_array_has_neither_path_nor_reference_system() -> None:
    source = parsed()["source"]
    assert source["path"] is source["crs"] is None
    assert source["points"] == len(taken().points)
    assert source["unit"] == "mm"


def test_reports_compare_by_value_and_keep_their_settings() -> None:
    assert replace(measured()) == measured()
    assert isinstance(measured().settings, Settings)
