"""Parts of a scene that lie far apart: measured as near ones are, in as little memory and time."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np
import pytest

from divespot import measure
from divespot.gaps import NO_GAPS, close_gaps
from divespot.grid import height_map
from divespot.settings import Settings
from reports import require_contract

if TYPE_CHECKING:
    from numpy.typing import NDArray

FAR_M = 4000.0


def cone(
    height_m: float, radius_m: float, at_m: tuple[float, float], seed: int
) -> NDArray[np.float64]:
    """Return points of a cone amid a floor of 12 by 12 m."""
    rng = np.random.default_rng(seed)
    plan = rng.uniform(-6.0, 6.0, (20_000, 2))
    z = height_m * np.maximum(0.0, 1.0 - np.hypot(*plan.T) / radius_m)
    return np.column_stack([plan + at_m, z]) + rng.normal(0.0, 0.005, (20_000, 3))


def volume_m3(height_m: float, radius_m: float) -> float:
    return math.pi * radius_m**2 * height_m / 3.0


@pytest.mark.parametrize("turn_rad", [0.0, 0.3, 1.2])
def test_two_piles_far_apart_take_no_more_than_two_near_ones(turn_rad: float) -> None:
    there = (FAR_M * math.cos(turn_rad), FAR_M * math.sin(turn_rad))
    points = np.concatenate([cone(1.5, 3.0, (0.0, 0.0), 0), cone(1.0, 2.0, there, 1)])
    before = time.process_time()
    report = measure(points)
    assert time.process_time() - before < 5.0, "a minute where every cell between them is looked at"
    require_contract(report)
    large, small = report.piles
    assert abs(large.volume_m3 - volume_m3(1.5, 3.0)) < large.u95_m3
    assert abs(small.volume_m3 - volume_m3(1.0, 2.0)) < small.u95_m3
    assert np.allclose(large.centroid_m[:2], (0.0, 0.0), atol=0.02)
    assert np.allclose(small.centroid_m[:2], there, atol=0.02)
    assert np.allclose(np.mean(small.outline_m, axis=0)[:2], there, atol=0.2)
    assert report.level.closed_map.heights_m.size < 50_000
    assert max(report.level.height_map.heights_m.shape) * report.level.height_map.cell_m > FAR_M


def test_a_pile_is_measured_the_same_alone() -> None:
    alone = cone(1.5, 3.0, (0.0, 0.0), 0)
    far = np.concatenate([alone, cone(1.0, 2.0, (FAR_M, 0.0), 1)])
    (found,), (same, _) = measure(alone, cell_m=0.2).piles, measure(far, cell_m=0.2).piles
    assert abs(found.volume_m3 - same.volume_m3) < 0.1 * found.u95_m3
    assert abs(found.u95_m3 - same.u95_m3) < 0.1 * found.u95_m3


def islands() -> NDArray[np.float64]:
    """Return three squares of 100 points a side, 0.1 m apart, none of them near another."""
    x, y = (v.ravel() for v in np.meshgrid(np.arange(100) * 0.1, np.arange(100) * 0.1))
    at = [(0.0, 0.0), (900.0, 30.0), (950.0, 2000.0)]
    return np.concatenate([np.column_stack([x + u, y + v, 0.0 * x]) for u, v in at])


def test_what_is_closed_up_is_opened_again() -> None:
    points = islands()
    closed, gaps = close_gaps(points.copy(), Settings(cell_m=0.2))
    assert np.ptp(closed, axis=0).max() < 100.0
    assert np.allclose(gaps.opened(closed), points, atol=1e-9)
    for axis in range(2):
        moved = (points - closed)[:, axis] / 0.2
        assert np.allclose(moved, np.rint(moved), atol=1e-6), "by whole cells"


def test_a_map_is_opened_to_that_of_all_cells() -> None:
    points = islands()
    closed, gaps = close_gaps(points.copy(), Settings(cell_m=1.0))
    opened, whole = gaps.opened_map(height_map(closed, 1.0)), height_map(points, 1.0)
    assert opened.heights_m.shape == whole.heights_m.shape
    assert np.array_equal(opened.counts, whole.counts)
    assert np.allclose(opened.heights_m, whole.heights_m, atol=1e-9, equal_nan=True)


def test_what_is_held_against_a_given_place_stays() -> None:
    given = ({"base": "height=0"}, {"inside": (0.0, 0.0, 9.0, 9.0)}, {"compare_bases": True})
    for what in given:
        points = islands()
        kept, gaps = close_gaps(points, Settings(cell_m=0.2).changed(**what))
        assert kept is points
        assert gaps is NO_GAPS
    near = islands()[:10_000]
    assert close_gaps(near, Settings(cell_m=0.2))[1] is NO_GAPS
