"""The height map and its integral."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

import divespot
import slow
from cases import CASES, UTM, WRONG_POINTS, scattered
from divespot import DivespotError

NOTHING = {"empty", "nothing finite"}
FILLED = sorted(set(CASES) - NOTHING - {"far stray"})


@pytest.mark.parametrize("name", FILLED)
@pytest.mark.parametrize("cell_m", [0.03, 0.25, 100.0])
def test_counts_and_gaps_are_those_of_the_definition(name: str, cell_m: float) -> None:
    grid = divespot.height_map(CASES[name], cell_m)
    means, counts = slow.height_map(CASES[name], cell_m)
    np.testing.assert_array_equal(grid.counts, counts)
    np.testing.assert_array_equal(np.isnan(grid.heights_m), counts == 0)
    # The middle of a cell is less than a cell from the mean along x and y, at two in one.
    assert np.nanmax(np.abs(grid.heights_m - means)) <= 2 * cell_m + 1e-9


@pytest.mark.parametrize("name", FILLED)
def test_one_cell_holds_the_mean(name: str) -> None:
    points = CASES[name].astype(float)
    mean_m = points[np.isfinite(points).all(axis=1), 2].mean()
    grid = divespot.height_map(points, 1e4)
    np.testing.assert_allclose(grid.heights_m, [[mean_m]], rtol=0, atol=1e-9)


SLOPES = [(0.0, 0.0), (0.5, 0.0), (0.0, -1.0), (0.7, 1.6), (-1.7, 1.7)]


@pytest.mark.parametrize("slope", SLOPES)
def test_points_crowded_in_a_corner_of_each_cell_lift_no_tilted_plane(
    slope: tuple[float, float],
) -> None:
    side = np.arange(40) / 16
    x, y = (a.ravel() for a in np.meshgrid(side, side))
    crowded = np.concatenate([np.c_[x + d, y + e] for d in (0, 1 / 128) for e in (0, 1 / 64)])
    grid = divespot.height_map(np.c_[crowded, crowded @ slope], 1 / 16)
    middle_x, middle_y = grid.centers_m()
    expected = slope[0] * middle_x + slope[1] * middle_y
    np.testing.assert_allclose(grid.heights_m, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("slope", SLOPES[1:4])
def test_random_points_on_a_tilted_plane_come_nearer_to_it_than_their_means(
    slope: tuple[float, float],
) -> None:
    xy = np.random.default_rng(1).uniform(0, 2, (40_000, 2))
    points = np.c_[xy, xy @ slope]
    grid = divespot.height_map(points, 0.05)
    x, y = grid.centers_m()
    inner = slice(1, -1), slice(1, -1)
    truth = (slope[0] * x + slope[1] * y)[inner]
    means, _ = slow.height_map(points, 0.05)
    off, off_means = grid.heights_m[inner] - truth, means[inner] - truth
    assert np.std(off) < 0.2 * np.std(off_means)
    assert abs(np.mean(off)) < 1e-4


def test_a_step_stays_within_its_column_and_the_next() -> None:
    xy = np.random.default_rng(1).uniform(0, 2, (40_000, 2))
    grid = divespot.height_map(np.c_[xy, np.where(xy[:, 0] < 1, 0.0, 1.0)], 0.05)
    heights_m = grid.heights_m[:-1, :-1]  # the last ones are slivers
    off = np.minimum(np.abs(heights_m), np.abs(heights_m - 1))
    assert np.count_nonzero(off.max(axis=0) > 1e-9) <= 2
    assert np.all((heights_m > -0.1) & (heights_m < 1.1))


def test_the_cells_lie_where_they_say() -> None:
    points = scattered(3000) + UTM
    grid = divespot.height_map(points, 0.1)
    x, y = grid.centers_m()
    low = points.min(axis=0)
    assert grid.origin_m == pytest.approx((low[0] - 0.025, low[1] - 0.025), abs=1e-9)
    for i in range(0, 3000, 300):
        row, column = np.unravel_index(
            np.argmin((x - points[i, 0]) ** 2 + (y - points[i, 1]) ** 2), x.shape
        )
        assert max(abs(x[row, column] - points[i, 0]), abs(y[row, column] - points[i, 1])) <= 0.0501
        assert grid.counts[row, column] > 0


def test_order_changes_no_bit() -> None:
    points = scattered(20_000)
    order = np.random.default_rng(1).permutation(len(points))
    one, other = divespot.height_map(points, 0.03), divespot.height_map(points[order], 0.03)
    for name in ("heights_m", "counts"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()


def test_an_offset_that_is_exact_changes_no_height() -> None:
    points = scattered(5000)
    near, far = divespot.height_map(points, 0.03), divespot.height_map(points + UTM, 0.03)
    np.testing.assert_allclose(far.heights_m - 312, near.heights_m, rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", sorted(NOTHING))
def test_no_points_are_refused(name: str) -> None:
    with pytest.raises(
        DivespotError, match=r"0 usable points .* at least 1 are needed for a height map"
    ):
        divespot.height_map(CASES[name], 0.1)


@pytest.mark.parametrize("name", WRONG_POINTS)
def test_what_is_no_cloud_is_refused(name: str) -> None:
    with pytest.raises(DivespotError, match="points"):
        divespot.height_map(WRONG_POINTS[name], 0.1)  # type: ignore[arg-type]


@pytest.mark.parametrize("cell_m", [0, -1, float("nan"), float("inf"), "1", None])
def test_a_cell_must_be_above_nought(cell_m: float) -> None:
    with pytest.raises(DivespotError, match=r"cell_m is .* needed"):
        divespot.height_map(CASES["random"], cell_m)
    with pytest.raises(DivespotError, match=r"cell_m is .* needed"):
        divespot.integrate([1.0], cell_m)


def test_more_cells_than_fit_are_refused() -> None:
    with pytest.raises(DivespotError, match=r"grid of .* cells: a larger cell_m, .* is needed"):
        divespot.height_map(CASES["far stray"], 0.1)


@given(
    st_numpy.arrays(
        np.float64,
        st_numpy.array_shapes(max_dims=3, max_side=6),
        elements=st.one_of(st.floats(-1e6, 1e6), st.just(float("nan"))),
    ),
    st.floats(-10, 10),
)
def test_the_integral_is_that_of_the_definition(heights_m: slow.Floats, base_m: float) -> None:
    volume = divespot.integrate(heights_m, 0.5, base_m=base_m)
    cut, fill, area = slow.integrate(heights_m - base_m, 0.5)
    assert volume.cut_m3 == pytest.approx(cut, rel=1e-12, abs=1e-12)
    assert volume.fill_m3 == pytest.approx(fill, rel=1e-12, abs=1e-12)
    assert volume.area_m2 == area
    assert volume.volume_m3 == volume.cut_m3 - volume.fill_m3


def test_a_base_may_differ_from_cell_to_cell() -> None:
    heights = np.array([[1.0, 2.0], [np.nan, 0.0]])
    base = np.array([[0.5, 3.0], [0.0, np.nan]])
    volume = divespot.integrate(heights, 2.0, base_m=base)
    assert (volume.cut_m3, volume.fill_m3, volume.area_m2) == (2.0, 4.0, 8.0)
    assert divespot.integrate(heights, 2.0, base_m=base[:, :1]).area_m2 == 12.0


@pytest.mark.parametrize("base", [np.zeros(3), np.zeros((2, 2, 1, 2)), np.zeros((3, 2))])
def test_a_base_of_another_shape_is_refused(base: slow.Floats) -> None:
    with pytest.raises(DivespotError, match="base_m has shape"):
        divespot.integrate(np.zeros((2, 2)), 1.0, base_m=base)


@settings(max_examples=60, deadline=None)
@given(
    st_numpy.arrays(
        st.sampled_from([np.float32, np.float64]),
        st.tuples(st.integers(0, 30), st.just(3)),
        elements={"allow_nan": True, "allow_infinity": True},
    ),
    st.floats(1e-6, 1e6),
)
def test_any_cloud_has_a_map_or_an_error(points: slow.Floats, cell_m: float) -> None:
    finite = int(np.isfinite(points).all(axis=1).sum())
    try:
        grid = divespot.height_map(points, cell_m)
    except DivespotError:
        return
    assert grid.counts.sum() == finite
    assert np.array_equal(np.isnan(grid.heights_m), grid.counts == 0)
