"""Solids of known volume, through the whole of the public API."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import divespot
from divespot import Report
from reports import objects, result, volume_m3
from solids import SOLIDS, STEP_M, Floats, sampled, turned

MILLE = 1e-3
COARSE_M = 2 * STEP_M


@cache
def points(name: str) -> Floats:
    return sampled(SOLIDS[name], COARSE_M)


@cache
def rough(name: str) -> Floats:
    """Return points with noise, in multiples of 2**-20 m, exact at any offset."""
    noise = np.random.default_rng(7).normal(0, 0.002, len(points(name)))
    return points(name) + np.column_stack([0 * noise, 0 * noise, np.round(noise * 2**20) / 2**20])


@cache
def measured(name: str) -> Report:
    return divespot.measure(points(name))


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("cells", [1, 2, 4])
def test_the_integral_of_the_height_map_is_the_volume(name: str, cells: int) -> None:
    grid = divespot.height_map(sampled(SOLIDS[name]), cells * STEP_M)
    volume = divespot.integrate(grid.heights_m, grid.cell_m)
    assert volume.volume_m3 == pytest.approx(SOLIDS[name].volume_m3, rel=MILLE)
    assert volume.area_m2 == np.count_nonzero(grid.counts) * grid.cell_m**2
    assert volume.fill_m3 < 2 * MILLE * SOLIDS[name].volume_m3


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("base_m", [-0.5, 312.0])
def test_the_base_is_taken_off(name: str, base_m: float) -> None:
    grid = divespot.height_map(sampled(SOLIDS[name]) + np.array([5e6, -5e6, base_m]), 2 * STEP_M)
    volume = divespot.integrate(grid.heights_m, grid.cell_m, base_m=base_m)
    at_origin = divespot.height_map(sampled(SOLIDS[name]), 2 * STEP_M)
    expected = divespot.integrate(at_origin.heights_m, 2 * STEP_M)
    assert volume.volume_m3 == pytest.approx(expected.volume_m3, rel=1e-9)


@pytest.mark.parametrize("name", ["box", "wedge", "cone", "frustum"])
def test_measure_finds_the_one_solid_and_its_volume(name: str) -> None:
    report = divespot.measure(sampled(SOLIDS[name]))
    assert volume_m3(report) == pytest.approx(SOLIDS[name].volume_m3, rel=MILLE)
    (found,) = objects(report)
    assert found.fill_m3 < 1e-9
    assert found.seen_fraction == 1
    assert not found.touches_edge


def test_measure_finds_a_hemisphere() -> None:
    # Its rim is upright: points there are far apart, and clusters end before it does.
    # Four crumbs of its foot are walked to from the floor.
    report = divespot.measure(sampled(SOLIDS["hemisphere"]))
    largest_m3 = max(found.volume_m3 for found in objects(report))
    assert largest_m3 == pytest.approx(SOLIDS["hemisphere"].volume_m3, rel=5 * MILLE)


@pytest.mark.parametrize("name", ["wedge", "cone", "frustum"])
def test_what_lies_as_poured_is_a_pile(name: str) -> None:
    assert len(measured(name).piles) == 1
    assert not measured(name).other_objects


@pytest.mark.parametrize("name", ["box", "hemisphere"])
def test_what_stands_steeper_is_none(name: str) -> None:
    assert not measured(name).piles
    (found,) = measured(name).other_objects
    # Without a point on its sides it is a cluster of its own.
    assert found.reason in ("steep sides", "apart from the ground")
    assert any("no pile" in warning for warning in measured(name).warnings)


def test_centroid_and_top_of_a_cone() -> None:
    (cone,) = measured("cone").piles
    assert cone.centroid_m == pytest.approx((0, 0, 0.25 / 4), abs=1e-3)
    assert cone.max_height_m == pytest.approx(0.25, abs=COARSE_M)
    assert cone.footprint_m2 == pytest.approx(np.pi * 0.25, rel=0.1)


@pytest.mark.parametrize("name", SOLIDS)
def test_far_from_the_origin_the_volume_is_the_same(name: str) -> None:
    # Numbers like those of a survey say that z is up; taken as it is, both are.
    near = [found.volume_m3 for found in objects(divespot.measure(rough(name), level=False))]
    for offset in ([5e6, 0, 0], [0, -5e6, 312], [5e6, 5e6, -5e6]):
        report = divespot.measure(rough(name) + offset, level=False)
        far = [found.volume_m3 for found in objects(report)]
        assert far == pytest.approx(near, rel=1e-9)


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("angle_deg", [17.3, 90, 300.1])
def test_turned_about_z_the_volume_is_the_same(name: str, angle_deg: float) -> None:
    report = divespot.measure(turned(points(name), angle_deg))
    assert volume_m3(report) == pytest.approx(volume_m3(measured(name)), rel=1e-9)
    assert len(report.piles) == len(measured(name).piles)


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("roll_deg", [30, 180])
def test_tilted_the_volume_is_nearly_the_same(name: str, roll_deg: float) -> None:
    tilted = turned(points(name)[:, [1, 2, 0]], roll_deg)[:, [2, 0, 1]]
    # Upside down, nothing but the user tells it from a pit.
    report = divespot.measure(tilted, up="-z" if roll_deg == 180 else "auto")
    assert volume_m3(report) == pytest.approx(volume_m3(measured(name)), rel=1e-9)


@pytest.mark.parametrize("name", SOLIDS)
def test_order_threads_and_number_type_change_no_bit(name: str) -> None:
    single = rough(name).astype(np.float32)
    cloud = single.astype(np.float64)
    expected = result(divespot.measure(cloud))
    order = np.random.default_rng(5).permutation(len(cloud))
    assert result(divespot.measure(cloud[order], threads=1)) == expected
    assert result(divespot.measure(single, threads=2)) == expected
    assert result(divespot.measure(np.asfortranarray(cloud), threads=4)) == expected


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize(
    ("scale", "digits"), [(2, 1e-12), (1 / 64, 1e-12), (1000, 1e-9), (0.01, 1e-9)]
)
def test_volume_goes_with_the_cube_of_the_scale(name: str, scale: float, digits: float) -> None:
    report = divespot.measure(points(name) * scale)
    assert volume_m3(report) / scale**3 == pytest.approx(volume_m3(measured(name)), rel=digits)
    assert len(report.piles) == len(measured(name).piles)
    assert result(report)["piles"] or result(report)["other_objects"]


def test_duplicates_do_not_count() -> None:
    # One height a cell: where points repeat evenly, nothing changes but their number.
    twice = np.repeat(points("cone"), 2, axis=0)
    assert volume_m3(divespot.measure(twice)) == pytest.approx(
        volume_m3(measured("cone")), rel=1e-12
    )


def test_settings_carry_the_lengths_of_the_scale() -> None:
    metres, kilometres = measured("cone").settings, divespot.measure(points("cone") * 1024).settings
    assert kilometres.cell_m is not None
    assert kilometres.cell_m == 1024 * (metres.cell_m or 0)
