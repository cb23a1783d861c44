"""Lengths that follow from a scan, each rule where it begins to hold."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from divespot.lengths import by_flatness, by_noise, by_survey, flatness, ground_lengths
from divespot.settings import Settings
from divespot.spacing import Survey


def survey(
    positions: int, *, regular: bool = False, spacing_m: float = 1.0, at_m: object = ()
) -> Survey:
    nothing = np.zeros((0, 3))
    at = np.asarray(at_m, float).reshape(-1, 3)
    return Survey(spacing_m, regular, 0.0, at, nothing, spacing_m, positions)


@pytest.mark.parametrize(
    ("positions", "regular", "cell_m"),
    [(14_000, False, 1 / 3), (28_000, False, 2.0), (4_200, True, 1 / 3), (8_500, True, 2.0)],
)
def test_where_a_pile_on_a_hundredth_of_the_scene_has_few_points_they_are_triangulated(
    positions: int,
    regular: bool,  # noqa: FBT001
    cell_m: float,
) -> None:
    settings = by_survey(Settings(), survey(positions, regular=regular))
    assert settings.cell_m == pytest.approx(cell_m)


def test_a_plane_is_as_thick_as_four_standard_deviations() -> None:
    assert by_flatness(Settings(), 0.01).stages.plane_threshold_m == pytest.approx(0.04)
    rough = dataclasses.replace(survey(100, regular=True), roughness_m=0.5)
    assert ground_lengths(rough)["plane_threshold_m"] == pytest.approx(2.0)


def test_a_toe_is_as_wide_as_material_at_15_degrees_is_below_the_margin() -> None:
    settings = by_noise(Settings(cell_m=0.1), 0.05)
    margin_m = 4.0 * 0.05
    assert settings.margin_m == pytest.approx(margin_m)
    assert settings.stages.toe_m == pytest.approx(margin_m / math.tan(math.radians(15.0)) + 0.1)


def test_a_floor_below_most_of_the_points_is_as_flat_as_it_is() -> None:
    rng = np.random.default_rng(3)
    at = rng.uniform(0.0, 10.0, (2000, 3)) * (1.0, 1.0, 0.3)
    at[:900, 2] = rng.normal(0.0, 0.01, 900)
    found_m = flatness(survey(2000, at_m=at), Settings())
    # The nearest 30 % of all are two thirds of the floor, which lie within 0.97 of it.
    assert found_m == pytest.approx(0.01 * 0.97 / 0.385, rel=0.15)


def test_a_floor_without_noise_is_a_thousandth_as_thick_as_its_points_are_apart() -> None:
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    flat = np.column_stack([x.ravel(), y.ravel(), 0.0 * x.ravel()])
    assert flatness(survey(400, at_m=flat), Settings()) == pytest.approx(1e-3 * 1.5, rel=1e-3)
