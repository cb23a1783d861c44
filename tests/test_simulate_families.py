"""Scenes of which the seed draws everything: their truth, and that they show what they are for."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from divespot.simulate import STRAY, THING, RoundWall, SimulatedScan, Wall, scan
from divespot.simulate.families import FAMILIES, OF_KIND
from divespot.simulate.thing_solids import solids_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.simulate import Surface

    Array = NDArray[np.float64]

DENSITY = 0.03
FEW_BODIES = ("body-01", "body-17")
TRIED = [name for name in FAMILIES if not name.startswith("body") or name in FEW_BODIES]


@cache
def taken(name: str, seed: int = 2) -> SimulatedScan:
    return scan(name, seed=seed, density=DENSITY)


def over_piles(one: SimulatedScan, label: int) -> int:
    """Return how many points of a kind lie well above the surface of a pile."""
    at = one.in_scene()[one.labels == label]
    x, y, z = at[np.isfinite(at).all(axis=1)].T
    high = z - one.surface.z(x, y) > 0.03 * one.surface.height_m.max()
    return int(np.count_nonzero(high & (one.surface.owner_at(x, y) > 0)))


def jittered(low: Array, high: Array, rng: np.random.Generator, side: int = 700) -> Array:
    """Draw a place in each cell of a rectangle of side by side cells."""
    cells = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)
    return np.asarray((low + (high - low) * (cells + rng.random(cells.shape)) / side).T)


def bilinear(surface: Surface, z: Array, x: Array, y: Array) -> Array:
    u, v = (x - surface.x[0]) / surface.node_m, (y - surface.y[0]) / surface.node_m
    i = np.clip(u.astype(int), 0, surface.x.size - 2)
    j = np.clip(v.astype(int), 0, surface.y.size - 2)
    u, v = u - i, v - j
    low = z[j, i] * (1 - u) + z[j, i + 1] * u
    high = z[j + 1, i] * (1 - u) + z[j + 1, i + 1] * u
    return np.asarray(low * (1 - v) + high * v)


def in_walls(one: SimulatedScan, x: Array, y: Array) -> NDArray[np.bool_]:
    walls = [thing for thing in one.scene.things if isinstance(thing, Wall | RoundWall)]
    solids = [solid for wall in walls for solid in solids_of(wall, 0, 0.0)]
    covered = [np.zeros(x.shape, dtype=bool), *(solid.covers(x, y) for solid in solids)]
    return np.asarray(np.any(covered, axis=0))


@pytest.mark.parametrize("name", TRIED)
def test_the_seed_decides_every_bit(name: str) -> None:
    again = scan(name, seed=2, density=DENSITY)
    assert again.points.tobytes() == taken(name).points.tobytes()
    assert again.volumes_m3 == taken(name).volumes_m3
    other = taken(name, 3)
    assert not np.array_equal(other.points[:100], again.points[:100])


@pytest.mark.parametrize("name", TRIED)
def test_the_truth_is_the_integral_of_the_surface(name: str) -> None:
    # Places drawn in each pile's rectangle know nothing of nodes or weights.
    one, rng = taken(name), np.random.default_rng(0)
    surface = one.surface
    for number, truth_m3 in enumerate(one.volumes_m3, start=1):
        rows, columns = np.nonzero(surface.owner == number)
        low = np.array([surface.x[columns].min(), surface.y[rows].min()]) - surface.node_m
        high = np.array([surface.x[columns].max(), surface.y[rows].max()]) + surface.node_m
        x, y = jittered(low, high, rng)
        height_m = bilinear(surface, np.where(surface.owner == number, surface.height_m, 0.0), x, y)
        volume_m3 = float(np.mean(height_m * ~in_walls(one, x, y)) * np.prod(high - low))
        assert volume_m3 == pytest.approx(truth_m3, rel=1e-3)


@pytest.mark.parametrize("name", [*OF_KIND["over"], *FEW_BODIES])
def test_something_is_over_the_pile(name: str) -> None:
    label = STRAY if name == "over-rain" else THING
    assert max(over_piles(taken(name, seed), label) for seed in (2, 3)) > 20
