"""Solids that rays meet in closed form, against a slow walk along each ray."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from divespot.simulate.pose import rotation
from divespot.simulate.solids import Arc, Capsule, Ellipsoid, Raised, Slab, Solid

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Inside = Callable[[Array], NDArray[np.bool_]]

STEP_M = 1e-3


def in_ellipsoid(at: Array) -> NDArray[np.bool_]:
    own = (at - [0.1, -0.05, 0.5]) @ rotation(0, 0, 30.0) / [0.3, 0.15, 0.1]
    return np.asarray((own**2).sum(axis=1) < 1)


def in_capsule(at: Array) -> NDArray[np.bool_]:
    start, end = np.array([-0.2, 0.1, 0.3]), np.array([0.3, -0.1, 0.6])
    share = np.clip((at - start) @ (end - start) / ((end - start) @ (end - start)), 0, 1)
    return np.asarray(np.linalg.norm(at - start - share[:, None] * (end - start), axis=1) < 0.08)


def in_slab(at: Array) -> NDArray[np.bool_]:
    own = (at - [0.0, 0.1, 0.4]) @ rotation(0, -20.0, 70.0)
    return np.asarray((np.abs(own) < [0.3, 0.15, 0.05]).all(axis=1))


def in_arc(at: Array) -> NDArray[np.bool_]:
    away, angle = np.hypot(at[:, 0], at[:, 1]), np.degrees(np.arctan2(at[:, 1], at[:, 0]))
    turned = (angle - 100.0) % 360 <= 200.0
    return np.asarray(turned & (away > 0.4) & (away < 0.5) & (at[:, 2] > 0) & (at[:, 2] < 0.6))


def in_raised(at: Array) -> NDArray[np.bool_]:
    return in_slab(at - [0.0, 0.0, 0.25])


SLAB = Slab((0.0, 0.1, 0.4), (0.6, 0.3, 0.1), 70.0, -20.0)
SOLIDS: list[tuple[Solid, Inside]] = [
    (Ellipsoid((0.1, -0.05, 0.5), (0.3, 0.15, 0.1), 30.0), in_ellipsoid),
    (Capsule((-0.2, 0.1, 0.3), (0.3, -0.1, 0.6), 0.08), in_capsule),
    (SLAB, in_slab),
    (Arc((0.0, 0.0, 0.0), 0.4, 0.1, 0.6, 100.0, 200.0), in_arc),
    (Raised(SLAB, 0.25), in_raised),
]


@pytest.mark.parametrize(("solid", "inside"), SOLIDS)
@pytest.mark.parametrize("lens", [(0.1, 0.2, 2.0), (1.5, -0.8, 0.9)])
def test_rays_meet_a_solid_where_they_enter_it(
    solid: Solid, inside: Inside, lens: tuple[float, float, float]
) -> None:
    rng, origin = np.random.default_rng(1), np.array(lens)
    rays = np.subtract(rng.uniform(-0.5, 0.5, (300, 3)), origin - [0, 0, 0.45])
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    steps = np.arange(0, 4, STEP_M)
    walked = np.array([inside(origin + steps[:, None] * ray) for ray in rays])
    slow = np.where(walked.any(axis=1), steps[walked.argmax(axis=1)], np.inf)
    fast = solid.meet(origin, rays)
    # A ray that only grazes may be inside for less than a step; an arc's ends are open.
    same = np.isclose(slow, fast, rtol=0, atol=2 * STEP_M)
    assert np.mean(same) > 0.96
    assert np.count_nonzero(same & np.isfinite(fast)) > 10
    middle, radius_m = solid.ball()
    met = origin + fast[np.isfinite(fast), None] * rays[np.isfinite(fast)]
    assert np.all(np.linalg.norm(met - middle, axis=1) < radius_m * (1 + 1e-9))
    assert np.mean(solid.covers(met[:, 0], met[:, 1])) > 0.4
