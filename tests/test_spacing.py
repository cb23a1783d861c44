"""The point spacing."""

import numpy as np
import pytest

import divespot
import slow
from cases import CASES, scattered
from divespot import DivespotError

FEW = {"empty", "one point", "all equal", "nothing finite"}


@pytest.mark.parametrize("name", sorted(set(CASES) - FEW))
def test_the_spacing_is_that_of_all_positions(name: str) -> None:
    points = CASES[name]  # fewer than are sampled
    np.testing.assert_allclose(divespot.point_spacing(points), slow.point_spacing(points), 1e-12)


@pytest.mark.parametrize("name", sorted(FEW))
def test_fewer_than_five_positions_are_refused(name: str) -> None:
    with pytest.raises(DivespotError, match=r"[01] usable points .* at least 5 .* point spacing"):
        divespot.point_spacing(CASES[name])


def test_a_square_grid_has_its_step() -> None:
    x, y = np.meshgrid(np.arange(200) * 0.25, np.arange(150) * 0.25)
    grid = np.c_[x.ravel(), y.ravel(), np.zeros(x.size)]
    assert divespot.point_spacing(grid) == 0.25
    assert divespot.point_spacing(np.repeat(grid, 10, axis=0)) == 0.25


def test_a_random_surface_has_one_tenth_more_than_its_mean_step() -> None:
    rng = np.random.default_rng(0)
    points = np.c_[rng.uniform(0, 3, (100_000, 2)), np.zeros(100_000)]
    mean_step = 3 / np.sqrt(100_000)
    for seed in range(3):
        assert divespot.point_spacing(points, seed=seed) / mean_step == pytest.approx(1.1, abs=0.04)


def test_order_does_not_count_but_the_seed_does() -> None:
    points = scattered(30_000)
    order = np.random.default_rng(1).permutation(len(points))
    spacing = divespot.point_spacing(points, seed=3)
    assert divespot.point_spacing(points[order], seed=3) == spacing
    assert divespot.point_spacing(points, seed=4) != spacing
