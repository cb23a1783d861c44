"""The height histogram and the ground's peak."""

from typing import Any, Literal, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

import divespot
import slow
from cases import CASES
from divespot import DivespotError

Rule = Literal["first", "lower", "midpoint"]
RULES: tuple[Rule, ...] = get_args(Rule)


def scene(seed: int = 0) -> NDArray[np.float64]:
    """Floor at 0.25 m, 1 mm of noise, under a cone 0.3 m high."""
    rng = np.random.default_rng(seed)
    cone = 0.25 + 0.3 * (1 - np.sqrt(rng.uniform(size=20_000)))
    heights: NDArray[np.float64] = np.r_[rng.normal(0.25, 0.001, 30_000), cone]
    return heights


@pytest.mark.parametrize("name", sorted(set(CASES) - {"empty", "nothing finite"}))
@pytest.mark.parametrize(("bin_m", "window"), [(0.004, 1), (0.03, 5), (10.0, 3), (0.01, 1001)])
def test_counts_and_average_are_those_of_the_definition(
    name: str, bin_m: float, window: int
) -> None:
    heights = CASES[name][:, 2]
    found = divespot.height_histogram(heights, bin_m=bin_m, window=window)
    counts, smoothed = slow.height_histogram(heights, bin_m, window)
    np.testing.assert_array_equal(found.counts, counts)
    np.testing.assert_allclose(found.smoothed, smoothed, rtol=1e-14)
    assert len(found.centers_m) == len(counts)
    np.testing.assert_allclose(np.diff(found.centers_m), bin_m)


def test_the_window_does_not_shift_the_bins() -> None:
    heights = np.r_[np.repeat(np.arange(100.0), 3), np.full(500, 40.0)]
    for window in (1, 3, 9):
        found = divespot.height_histogram(heights, bin_m=1.0, window=window)
        top = np.flatnonzero(found.smoothed == found.smoothed.max())
        assert found.centers_m[top].mean() == pytest.approx(40.0, abs=0.5)
        assert len(top) == window


@pytest.mark.parametrize("rule", RULES)
def test_the_floor_under_a_cone_is_found(rule: Rule) -> None:
    for seed in range(3):
        ground = divespot.ground_height(scene(seed), bin_m=0.001, rule=rule)
        assert ground == pytest.approx(0.25, abs=3e-4)


@pytest.mark.parametrize("rule", RULES)
def test_stray_points_and_holes_do_not_move_the_ground(rule: Rule) -> None:
    clean = scene()
    ground = divespot.ground_height(clean, bin_m=0.001, rule=rule)
    astray = np.r_[clean, np.full(100, -7.0), [90.0, np.nan, np.inf]]
    assert divespot.ground_height(astray, bin_m=0.001, rule=rule) == pytest.approx(ground, abs=3e-4)


@pytest.mark.parametrize("rule", RULES)
def test_order_does_not_count_nor_does_an_offset(rule: Rule) -> None:
    heights = np.round(scene() * 2**20) / 2**20
    ground = divespot.ground_height(heights, bin_m=0.001, rule=rule)
    assert divespot.ground_height(np.sort(heights)[::-1], bin_m=0.001, rule=rule) == ground
    moved = divespot.ground_height(heights + 4096, bin_m=0.001, rule=rule)
    assert moved - 4096 == pytest.approx(ground, abs=1e-11)


def test_the_rules_differ_where_they_should() -> None:
    rng = np.random.default_rng(0)
    levels = [(0.0, 9000), (0.012, 7000), (0.02, 8000), (0.5, 40_000)]
    heights = np.concatenate([rng.normal(z, 0.001, count) for z, count in levels])
    found = {rule: divespot.ground_height(heights, bin_m=0.001, rule=rule) for rule in RULES}
    assert found == pytest.approx({"first": 0.0, "lower": 0.0, "midpoint": 0.01}, abs=3e-4)
    highest = divespot.ground_height(heights, bin_m=0.001, lower_fraction=1.0)
    assert highest == pytest.approx(0.5, abs=3e-4)


def test_a_floor_without_noise_is_exact() -> None:
    heights = np.full(1000, 0.8125)
    assert all(divespot.ground_height(heights, bin_m=0.01, rule=rule) == 0.8125 for rule in RULES)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"bin_m": 0.0}, "bin_m is 0: a finite number above 0 is needed"),
        ({"bin_m": "1"}, "bin_m is '1': a number is needed"),
        ({"bin_m": 1e-12}, r"larger bin_m"),
        ({"window": 4}, "window is 4: an odd number of bins is needed"),
        ({"window": 2.5}, "window is 2.5: a whole number"),
        ({"rule": "best"}, "rule is 'best': 'first', 'lower' or 'midpoint' is needed"),
        ({"lower_fraction": 0.0}, "lower_fraction is 0: a number above 0 and up to 1 is needed"),
        (
            {"heights_m": []},
            r"0 usable points were given: at least 1 are needed for a height histogram",
        ),
        ({"heights_m": [np.nan]}, r"0 usable points"),
        ({"heights_m": np.zeros((3, 3))}, r"heights_m have shape \(3, 3\) .* shape \(n,\)"),
        ({"heights_m": ["a"]}, r"heights_m have shape \(1,\) and dtype <U1"),
    ],
)
def test_bad_input_is_refused_in_one_line(wrong: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"heights_m": scene(), "bin_m": 0.001} | wrong
    with pytest.raises(DivespotError, match=message):
        divespot.ground_height(given.pop("heights_m"), **given)
