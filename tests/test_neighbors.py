"""The radius filter."""

import numpy as np
import pytest

import divespot
import slow
from cases import CASES, scattered


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("radius_m", [0.0078125, 0.0625, 0.625])
def test_the_mask_is_that_of_all_pairs(name: str, radius_m: float) -> None:
    points = CASES[name]
    neighbors = slow.neighbors(points, radius_m)
    for min_neighbors in (1, 4, 30, 999, 1000):
        mask = divespot.radius_outlier_mask(points, radius_m, min_neighbors)
        assert mask.dtype == np.bool_
        np.testing.assert_array_equal(mask, neighbors >= min_neighbors, str(min_neighbors))


def test_a_neighbor_may_lie_exactly_on_the_radius() -> None:
    points = CASES["exactly on the radius"]
    assert divespot.radius_outlier_mask(points, 0.625, 4).tolist() == [True] + 4 * [False]
    assert not divespot.radius_outlier_mask(points, np.nextafter(0.625, 0), 1).any()


def test_none_needed_keeps_every_finite_row() -> None:
    points = CASES["not finite"]
    mask = divespot.radius_outlier_mask(points, 0.1, 0)
    np.testing.assert_array_equal(mask, np.isfinite(points).all(axis=1))


def test_duplicates_are_neighbors_of_each_other() -> None:
    points = np.repeat([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]], [4, 1], axis=0)
    assert divespot.radius_outlier_mask(points, 1e-3, 3).tolist() == 4 * [True] + [False]


def test_a_shuffled_cloud_has_the_shuffled_mask() -> None:
    points = scattered(20_000)
    order = np.random.default_rng(1).permutation(len(points))
    mask = divespot.radius_outlier_mask(points, 0.02, 4)
    np.testing.assert_array_equal(divespot.radius_outlier_mask(points[order], 0.02, 4), mask[order])
    assert 0.01 < mask.mean() < 0.99


def test_scale_does_not_count() -> None:
    points = scattered(5000)
    mask = divespot.radius_outlier_mask(points, 0.04, 4)
    for scale in (2.0**-40, 2.0**20):
        scaled = divespot.radius_outlier_mask(points * scale, 0.04 * scale, 4)
        np.testing.assert_array_equal(scaled, mask)
