"""Which way is up, and the evidence for it."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import Report

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from slow import Floats

OFFSET_M = np.array((432_000.0, 5_391_000.0, 120.0))
"""Where a survey in a projected system lies."""


def cone(x: Floats, y: Floats, at: tuple[float, float], r: float, h: float) -> Floats:
    return np.asarray(np.clip(h * (1 - np.hypot(x - at[0], y - at[1]) / r), 0, None))


def survey(height: Callable[[Floats, Floats], Floats]) -> Floats:
    """Fly over a yard of 100 m, z up."""
    rng = np.random.default_rng(1)
    plan = rng.uniform(0, 100, (12_000, 2))
    return np.asarray(np.c_[plan, height(*plan.T) + rng.normal(0, 0.02, len(plan))])


def raster(half_m: tuple[float, float], step_m: float) -> Floats:
    x, y = (np.arange(-h, h, step_m) for h in half_m)
    return np.asarray(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))


def noisy(*parts: Floats) -> Floats:
    points = np.concatenate(parts)
    return np.asarray(points + np.random.default_rng(2).normal(0, 0.001, points.shape))


def yard() -> Floats:
    plan = raster((1.2, 1.0), 0.02)
    x, y = plan.T
    return noisy(np.c_[plan, cone(x, y, (0.1, 0.0), 0.5, 0.28)])


SURVEYS: dict[str, Callable[[Floats, Floats], Floats]] = {
    "a pit larger than the heap": lambda x, y: (
        cone(x, y, (25, 25), 8, 5) - cone(x, y, (70, 70), 10, 5)
    ),
    "a terrace": lambda x, y: (
        cone(x, y, (25, 25), 8, 5) + cone(x, y, (85, 60), 6, 3) - np.clip(0.577 * (x - 60), 0, 4)
    ),
    "a ditch": lambda x, y: (
        cone(x, y, (25, 25), 5, 2) - np.clip(2.5 - 0.8 * np.abs(x - 85), 0, None)
    ),
    "a bowl": lambda x, y: 0.3 * np.clip(np.hypot(x - 50, y - 50) - 20, 0, None),
    "a slope": lambda x, _: 0.15 * x,
}


def tilt_deg(report: Report, up: tuple[float, ...]) -> float:
    return float(np.degrees(np.arccos(np.clip(np.dot(report.ground.normal, up), -1, 1))))


@pytest.mark.parametrize("name", SURVEYS)
def test_z_is_up_in_a_projected_survey(name: str) -> None:
    report = divespot.measure(survey(SURVEYS[name]) + OFFSET_M)
    assert report.ground.up_from == "coordinate system"
    assert report.ground.normal == (0, 0, 1)
    assert not any("upside" in warning for warning in report.warnings)


def test_a_scan_that_is_tilted_in_coordinates_like_a_survey_s_is_laid_level() -> None:
    up = tuple(turned_about_x(np.array([[0.0, 0.0, 1.0]]), 13.0)[0])
    report = divespot.measure(turned_about_x(yard(), 13.0) + OFFSET_M)
    assert report.ground.up_from == "coordinate system"
    assert tilt_deg(report, up) < 0.3
    assert any("13° off: the scan was taken as tilted" in w for w in report.warnings)


def test_a_slope_keeps_its_tilt_in_the_report() -> None:
    report = divespot.measure(survey(SURVEYS["a slope"]) + OFFSET_M)
    assert report.ground.tilt_deg == pytest.approx(np.degrees(np.arctan(0.15)), abs=0.2)


def test_a_wall_larger_than_the_floor_is_no_ground_of_a_survey() -> None:
    side = raster((50, 30), 0.8) + np.array((50, 30))
    wall = np.c_[side[:, 0], np.full(len(side), 100.0), side[:, 1]]
    floor = survey(lambda x, y: cone(x, y, (50, 80), 8, 5))
    report = divespot.measure(np.concatenate([floor[floor[:, 1] > 60], wall]) + OFFSET_M)
    assert report.ground.normal == (0, 0, 1)
    assert report.ground.offset_m == pytest.approx(120, abs=0.2)


def pit() -> Floats:
    plan = raster((1.2, 1.0), 0.02)
    return noisy(np.c_[plan, -0.1 * np.clip(1 - (np.hypot(*plan.T) / 0.4) ** 2, 0, 1)])


def dock() -> Floats:
    low = raster((0.5, 1.4), 0.02) + np.array((2.1, 0))
    return noisy(yard(), np.c_[low, np.full(len(low), -1.0)])


@pytest.mark.parametrize("points", [pit(), dock(), yard()], ids=["pit", "dock", "yard"])
def test_z_is_up_where_a_floor_is_level_in_it(points: Floats) -> None:
    report = divespot.measure(points)
    assert report.ground.up_from == "small tilt"
    assert tilt_deg(report, (0, 0, 1)) < 1


def test_a_pit_alone_may_be_a_scan_upside_down() -> None:
    warnings = divespot.measure(pit()).warnings
    assert any("seems to be upside down" in warning for warning in warnings)
    assert not any("upside down" in w for w in divespot.measure(pit(), up="z").warnings)


def turned_about_x(points: Floats, angle_deg: float) -> Floats:
    a = np.radians(angle_deg)
    turn = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    return np.asarray(points @ turn.T)


@pytest.mark.parametrize("angle_deg", [177.0, 90.0, -40.0])
def test_a_scan_that_lies_anyhow_lies_on_its_ground(angle_deg: float) -> None:
    up = tuple(turned_about_x(np.array([[0.0, 0.0, 1.0]]), angle_deg)[0])
    report = divespot.measure(turned_about_x(yard(), angle_deg))
    assert report.ground.up_from == "nothing below"
    assert tilt_deg(report, up) < 1


def frame(pitch_deg: float, height: Callable[[Floats, Floats], Floats]) -> Floats:
    """Look from 1.5 m above a floor, `pitch_deg` from straight down: x right, z ahead."""
    u, v = np.meshgrid(np.linspace(-0.6, 0.6, 120), np.linspace(-0.45, 0.45, 90))
    a = np.radians(pitch_deg)
    ahead = np.sin(a) - v * np.cos(a)
    down = np.cos(a) + v * np.sin(a)
    place_m = 1.5 * np.tan(a)
    distance = 1.5 / down
    for _ in range(60):
        over = height(u * distance, ahead * distance - place_m)
        distance = 0.5 * (distance + (1.5 - over) / down)
    distance = distance + np.random.default_rng(3).normal(0, 0.001, distance.shape)
    return np.stack([u * distance, v * distance, distance], axis=-1)


def up_of_frame(pitch_deg: float) -> tuple[float, ...]:
    a = np.radians(pitch_deg)
    return (0.0, -float(np.sin(a)), -float(np.cos(a)))


def heap(x: Floats, y: Floats) -> Floats:
    return cone(x, y, (0.0, 0.0), 0.35, 0.17)


def hole(x: Floats, y: Floats) -> Floats:
    return -heap(x, y)


@pytest.mark.parametrize("pitch_deg", [0.0, 20.0, 35.0])
@pytest.mark.parametrize("height", [heap, hole])
def test_a_camera_sees_its_floor_from_above(
    pitch_deg: float, height: Callable[[Floats, Floats], Floats]
) -> None:
    report = divespot.measure(frame(pitch_deg, height))
    assert report.ground.up_from == "sensor"
    assert tilt_deg(report, up_of_frame(pitch_deg)) < 1


@pytest.mark.parametrize("height", [heap, hole])
def test_a_frame_need_not_be_a_raster(height: Callable[[Floats, Floats], Floats]) -> None:
    points = np.random.default_rng(4).permutation(frame(35.0, height).reshape(-1, 3))
    report = divespot.measure(points)
    assert report.ground.up_from == "sensor"
    assert tilt_deg(report, up_of_frame(35.0)) < 1


def test_a_raster_gives_what_its_points_give(tmp_path: Path) -> None:
    points = frame(35.0, heap).astype(np.float32)
    np.save(tmp_path / "frame.npy", points)
    of_array, of_file = (divespot.measure(s) for s in (points, tmp_path / "frame.npy"))
    assert of_array.piles == of_file.piles
    assert of_file.ground.up_from == "sensor"
    assert of_array.source.points == 120 * 90


@pytest.mark.parametrize("off_m", [0.7, -0.7, 0.0])
def test_a_raster_of_heights_was_seen_from_no_place(off_m: float) -> None:
    plan = raster((1.2, 1.0), 0.02)
    x, y = plan.T
    heights = cone(x, y, (0.1, 0.0), 0.5, 0.28) + off_m
    report = divespot.measure(np.c_[plan, heights].reshape(100, 120, 3))
    assert report.ground.up_from != "sensor"
    assert tilt_deg(report, (0, 0, 1)) < 1


def pcd(path: Path, points: Floats, viewpoint: str) -> Path:
    lines = "\n".join(" ".join(f"{v:.5f}" for v in p) for p in points)
    path.write_text(
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT {viewpoint}\nPOINTS {len(points)}\n"
        f"DATA ascii\n{lines}\n"
    )
    return path


@pytest.mark.parametrize(
    ("viewpoint", "up_from", "z"),
    [
        ("0.3 0 2 1 0 0 0", "sensor", 1),
        ("0 0 0 1 0 0 0", "small tilt", 1),
        ("0.3 0 -2 0 1 0 0", "sensor", -1),
        ("0 0 nan 1 0 0 0", "small tilt", 1),
        ("0 0", "small tilt", 1),
    ],
)
def test_the_viewpoint_of_a_pcd_says_where_the_sensor_was(
    tmp_path: Path, viewpoint: str, up_from: str, z: int
) -> None:
    report = divespot.measure(pcd(tmp_path / "a.pcd", yard(), viewpoint))
    assert report.ground.up_from == up_from
    assert tilt_deg(report, (0, 0, z)) < 1
    assert any("stood below it in z" in w for w in report.warnings) == (z < 0)


def test_points_in_the_sensor_s_own_frame_were_seen_from_their_origin(tmp_path: Path) -> None:
    points = frame(35.0, heap).reshape(-1, 3)
    report = divespot.measure(pcd(tmp_path / "a.pcd", points, "0 0 9 0.5 0.5 0.5 0.5"))
    assert report.ground.up_from == "sensor"
    assert tilt_deg(report, up_of_frame(35.0)) < 1


def test_a_given_up_beats_the_sensor_with_a_warning(tmp_path: Path) -> None:
    report = divespot.measure(pcd(tmp_path / "a.pcd", yard(), "0 0 2 0 1 0 0"), up="-z")
    assert report.ground.up_from == "given"
    assert tilt_deg(report, (0, 0, -1)) < 1
    assert any("2 m below the ground, which it cannot see" in w for w in report.warnings)


def test_a_given_up_beats_the_coordinate_system_with_a_warning() -> None:
    points = survey(SURVEYS["a ditch"]) + OFFSET_M
    report = divespot.measure(points, up="-z")
    assert report.ground.up_from == "given"
    assert tilt_deg(report, (0, 0, -1)) < 1
    assert any("given as -z" in w and "projected" in w for w in report.warnings)


def test_a_given_up_is_as_exact_as_the_coordinate_system_that_agrees() -> None:
    report = divespot.measure(survey(SURVEYS["a slope"]) + OFFSET_M, up="0,0.2,1")
    assert report.ground.up_from == "given"
    assert report.ground.normal == (0, 0, 1)
    assert not any("given as" in warning for warning in report.warnings)


def test_the_reason_is_in_the_json() -> None:
    assert json.loads(divespot.measure(yard()).to_json())["ground"]["up_from"] == "small tilt"
    assert divespot.measure(yard(), level=False).ground.up_from == "given"
