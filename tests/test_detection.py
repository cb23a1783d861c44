"""The detection limit of a change."""

from __future__ import annotations

import dataclasses
import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import Comparison
from divespot.detection import Spread
from divespot.place_maps import inner
from divespot.reasons import AT_EDGE, IN_BOTH, NOT_DETECTED
from divespot.simulate import scan, scene_named
from test_differences import noisy, plan

if TYPE_CHECKING:
    from slow import Floats

CELL_M = 0.1


def waves(seed: int, sigma_m: float, length: int, shape: tuple[int, int] = (128, 128)) -> Floats:
    """Return heights with errors correlated over some cells, as after registering frames."""
    coarse = np.random.default_rng(seed).normal(0.0, sigma_m, tuple(-(-n // length) for n in shape))
    return np.asarray(np.kron(coarse, np.ones((length, length)))[: shape[0], : shape[1]], float)


def test_errors_of_single_cells_average_out_and_common_ones_do_not() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.01, (128, 128))
    own = Spread.of(noise, CELL_M, 163.84)
    common = Spread.of(noise + waves(2, 0.005, 16), CELL_M, 163.84)
    for edge, u, _ in zip(own.edges_m, own.u_m, own.blocks, strict=True):
        cells = (edge / CELL_M) ** 2
        assert u == pytest.approx(0.01 / math.sqrt(cells), rel=0.5)
        assert common.u_of(edge**2) == pytest.approx(math.hypot(u, 0.005), rel=0.35) or edge > 1.0
    assert common.u_of(1.0) > 3 * own.u_of(1.0)
    # A steep place is as unsure as the surveys lie apart sideways.
    assert own.u_m3(2.0, 2.0) == pytest.approx(math.sqrt(2.0) * own.u_m3(2.0))


def test_a_part_that_changed_hides_nothing() -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.01, (100, 100))
    changed = noise.copy()
    changed[:20, :20] += 1.0
    before, after = (Spread.of(values, CELL_M, 100.0) for values in (noise, changed))
    for area_m2 in (CELL_M**2, 0.1, 1.0, 10.0):
        assert before.u_of(area_m2) <= after.u_of(area_m2) < 0.012


def test_more_places_to_look_at_need_a_clearer_change() -> None:
    noise = np.random.default_rng(4).normal(0.0, 0.01, (128, 128))
    small, large = (Spread.of(noise, CELL_M, area).clear_by(0.16) for area in (1.0, 1e4))
    # Bonferroni for 1.0 / 0.16 and 1e4 / 0.16 places: quantiles of the normal distribution.
    assert small == pytest.approx(2.66, abs=0.02)
    assert large == pytest.approx(4.94, abs=0.05)
    # From few blocks the uncertainty is not well known (Student, 15 degrees of freedom).
    few = Spread.of(noise, CELL_M, 10.24).clear_by(10.24)
    assert few == pytest.approx(2.13, abs=0.03)


def test_without_stable_ground_nothing_is_known() -> None:
    nothing = Spread.of(np.full((30, 30), math.nan), CELL_M, 9.0)
    assert (nothing.edges_m, nothing.u_of(1.0), nothing.clear_by(1.0)) == ((), 0.0, 0.0)
    assert Spread.of(np.zeros((2, 2)), CELL_M, 0.04).edges_m == ()


def test_the_edge_is_where_a_scan_ends_not_a_cell_without_points() -> None:
    from divespot.grid import HeightMap  # noqa: PLC0415

    off = np.zeros((20, 20))
    off[10, 10] = off[:, 15:] = math.nan
    grid = HeightMap(off, np.full(off.shape, 4, np.uint32), (0.0, 0.0), 1.0)
    found = inner(off, grid)
    assert found[10, 8:13].all()
    assert found[2:18, 2].all()
    assert not found[:, 13:].any()
    assert not found[:2].any()


@cache
def again(seed: int, gone: int | None = None) -> Comparison:
    """Compare a place with itself, scanned again with fresh noise and registration."""
    before = scene_named("three-piles")
    piles = tuple(pile for i, pile in enumerate(before.piles) if i != gone)
    after = dataclasses.replace(before, piles=piles)
    return divespot.compare(
        scan(before, density=0.03, seed=seed).points,
        scan(after, density=0.03, seed=seed, repeat=1).points,
    )


def test_where_nothing_changed_nothing_is_counted() -> None:
    found = again(1)
    assert found.places == ()
    assert found.net.is_none
    assert found.net.volume_m3 == 0.0
    # The frames of each scan lie some millimetres apart, over a metre and more.
    reasons = {place.reason for place in found.not_counted}
    assert reasons >= {NOT_DETECTED, IN_BOTH}
    assert reasons <= {NOT_DETECTED, IN_BOTH, AT_EDGE, "not clear of the ground"}
    assert any("not counted" in text for text in found.warnings)


def test_a_pile_that_is_gone_is_counted_and_within_its_u95() -> None:
    found = again(1, 2)
    (place,) = found.places
    truth = -scene_named("three-piles").piles[2].volume_m3
    assert abs(place.net.volume_m3 - truth) < place.net.u95_m3 < 0.12 * abs(truth)
    assert place.detection_m3 < abs(truth)
    assert found.gain.is_none
    assert (found.loss, found.net) == (place.net, place.net)


def skip(seed: int, level: float) -> Floats:
    """Return an open container on a yard, filled to a level."""
    rng = np.random.default_rng(seed)
    x, y = plan(seed, (3.0, 3.0), 90_000)
    yard = np.column_stack([x, y, 0.0 * x])[(np.abs(x) > 1.05) | (np.abs(y) > 0.85)]
    x, y = plan(seed + 50, (1.0, 0.8), 20_000)
    content = np.column_stack([x, y, level + 0.1 * x])
    sides = []
    for axis, sign in ((0, 1), (0, -1), (1, 1), (1, -1)):
        for at, low in ((0.05, 0.0), (0.0, level)):
            side = np.zeros((6000, 3))
            side[:, axis] = sign * ((1.0, 0.8)[axis] + at)
            side[:, 1 - axis] = rng.uniform(-1, 1, 6000) * (0.8, 1.0)[axis]
            side[:, 2] = rng.uniform(low, 1.0, 6000)
            sides.append(side)
    return noisy(seed, yard, content, *sides)


def test_what_came_into_an_open_container_is_counted() -> None:
    found = divespot.compare(skip(1, 0.3), skip(2, 0.7))
    assert abs(found.net.volume_m3 - 0.4 * 2.0 * 1.6) < found.net.u95_m3


def test_of_fewer_than_six_blocks_nothing_is_said() -> None:
    def edges(side: int) -> tuple[float, ...]:
        return Spread.of(np.ones((side, side)), 1.0, float(side * side)).edges_m

    # 64, 16 and 4 blocks; 144, 36, 9 and 4.
    assert edges(8) == (1.0, 2.0)
    assert edges(12) == (1.0, 2.0, 4.0)


def test_the_spread_of_normal_differences_is_their_standard_deviation() -> None:
    stable = np.random.default_rng(1).normal(0.0, 0.01, (200, 200))
    assert Spread.of(stable, 1.0, 4e4).u_m[0] == pytest.approx(0.01, rel=0.03)


def test_errors_go_together_up_to_blocks_that_are_half_as_sure() -> None:
    spread = Spread((1.0, 2.0, 4.0), (1.0, 0.8, 0.35), (400, 100, 25), 400.0)
    assert spread._independent(1.0) == 100


def test_one_comparison_of_twenty_lists_a_place_that_did_not_change() -> None:
    spread = Spread((1.0,), (1.0,), (1_000_000,), 1.0)
    assert spread.clear_by(1.0) == pytest.approx(1.96, abs=0.01)
