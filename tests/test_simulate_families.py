"""Scenes of which the seed draws everything: their truth, and that they show what they are for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

from divespot.errors import DivespotError
from divespot.simulate import (
    GROUND,
    STRAY,
    THING,
    RoundWall,
    SimulatedScan,
    Wall,
    scan,
    scene_named,
)
from divespot.simulate.families import FAMILIES, OF_KIND
from divespot.simulate.level import Level
from divespot.simulate.terrain import terrain
from divespot.simulate.thing_solids import solids_of
from divespot.simulate.tripod import Tripod

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.simulate import Surface

    Array = NDArray[np.float64]

DENSITY = 0.03
FEW_BODIES = ("body-01", "body-17")
TRIED = [name for name in FAMILIES if not name.startswith("body-") or name in FEW_BODIES]


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
    covered = [
        np.zeros(np.broadcast_shapes(x.shape, y.shape), dtype=bool),
        *(solid.covers(x, y) for solid in solids),
    ]
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


@pytest.mark.parametrize("name", sorted(set(OF_KIND["walls"]) - {"walls-bench"}))
def test_the_pile_meets_a_wall(name: str) -> None:
    one = taken(name)
    surface = one.surface
    rows, columns = np.nonzero(surface.height_m > 0.1 * surface.height_m.max())
    x, y = surface.x[columns], surface.y[rows]
    assert 0.01 < np.mean(in_walls(one, x, y)) < 0.3
    walls = one.in_scene()[one.labels == THING]
    assert np.count_nonzero(walls[:, 2] > 0.5 * surface.height_m.max()) > 50


def test_the_pile_lies_on_the_face_of_the_bench() -> None:
    surface = taken("walls-bench").surface
    under_m = surface.ground_m[surface.owner == 1]
    assert under_m.min() == 0.0
    assert 0.1 < under_m.max() / surface.height_m.max() < 1.5
    assert surface.ground_m.max() > surface.height_m.max()


def test_the_wedge_fills_its_bay_from_wall_to_wall() -> None:
    surface = taken("walls-wedge").surface
    row = surface.height_m[np.argmax(surface.height_m.sum(axis=1))]
    filled = row > 0.9 * row.max()
    assert np.count_nonzero(filled) > 0.8 * np.count_nonzero(row)


def test_a_round_wall_cuts_the_truth() -> None:
    one = taken("walls-round")
    (wall,) = one.scene.things
    assert isinstance(wall, RoundWall)
    at = one.in_scene()[one.labels == 1]
    away_m = np.hypot(*(at[:, :2] - wall.center_m).T)
    assert away_m.max() == pytest.approx(wall.radius_m, rel=0.03)


@pytest.mark.parametrize("seed", range(4))
def test_a_loader_leaves_a_face_steeper_than_the_material_lies(seed: int) -> None:
    scene = scene_named("cut-face", seed)
    (pile,) = scene.piles
    assert pile.cut is not None
    scene = replace(scene, piles=(replace(pile, roughness_m=0.0),))
    surface, (volume_m3,) = terrain(scene, seed)
    assert volume_m3 == pytest.approx(pile.volume_m3, rel=1e-9)
    slope = np.degrees(np.arctan(np.hypot(*np.gradient(surface.height_m, surface.node_m))))
    steep = slope > pile.repose_deg + 5
    assert np.count_nonzero(steep) > 200
    assert np.percentile(slope[steep], 75) == pytest.approx(pile.cut.face_deg, abs=1.5)


NOT_LEVEL = {"levels-slope", "levels-rolling"}


@pytest.mark.parametrize("name", sorted(set(OF_KIND["levels"]) - NOT_LEVEL))
def test_every_level_is_seen_and_up_is_z(name: str) -> None:
    one = taken(name)
    (level,) = one.scene.floor.levels
    ground_m = one.surface.ground_m
    assert np.ptp(ground_m) == pytest.approx(abs(level.rise_m), rel=1e-6)
    floor = one.in_scene()[one.labels == GROUND]
    at_level = np.abs(floor[:, 2] - level.rise_m) < 0.1 * abs(level.rise_m)
    assert np.count_nonzero(at_level) > 5
    assert np.count_nonzero(~at_level) > 300
    assert one.up[2] > 0.99
    if name == "levels-pit-alone":
        assert one.volumes_m3 == ()
    elif name == "levels-step":
        assert np.ptp(ground_m[one.surface.owner == 1]) == pytest.approx(level.rise_m)
    for number in range(1, len(one.volumes_m3) + 1):
        if not level.under_piles:
            assert np.ptp(ground_m[one.surface.owner == number]) == 0.0


def test_a_pile_on_a_face_needs_a_level_that_lets_it() -> None:
    scene = scene_named("levels-step", 1)
    levels = tuple(replace(level, under_piles=False) for level in scene.floor.levels)
    with pytest.raises(DivespotError, match="pile 1 lies on the face of a level"):
        scan(replace(scene, floor=replace(scene.floor, levels=levels)), density=DENSITY)


def test_a_level_rises_at_the_angle_of_its_face() -> None:
    x = np.linspace(-2, 2, 401)
    for rounded in (False, True):
        level = Level((0.5, 0.0), (1.0, 1.0), -0.3, 30.0, rounded=rounded)
        heights_m = level.heights(x, np.zeros(1))
        slope = np.gradient(heights_m, x)
        assert heights_m.min() == pytest.approx(-0.3)
        assert np.abs(slope).max() == pytest.approx(np.tan(np.radians(30.0)))
        assert np.all(heights_m[(x < -0.5) | (x > 1.5)] == 0)
    with pytest.raises(DivespotError, match="face_deg is 90"):
        Level((0.0, 0.0), (1.0, 1.0), 1.0, 90.0)


@pytest.mark.parametrize("seed", [2, 3])
def test_a_tripod_sees_little_of_what_is_far_and_nothing_behind_the_pile(seed: int) -> None:
    one = taken("scan-tripod", seed)
    scanner = one.scene.camera
    assert isinstance(scanner, Tripod)
    at = one.in_scene()[one.labels == GROUND]
    away_m = np.linalg.norm(at[:, None, :2] - np.array(scanner.stations_m), axis=2).min(axis=1)
    near = np.count_nonzero(away_m < 4.0) / (np.pi * 4.0**2)
    far_m = np.percentile(away_m, 99)
    far = np.count_nonzero(away_m > 0.7 * far_m) / (np.pi * far_m**2)
    assert near > 50 * far


def test_what_a_tripod_sees_lies_on_the_surface() -> None:
    scene = scene_named("scan-tripod", 2)
    still = replace(scene.camera, shift_m=0.0, turn_deg=0.0, pixels=(200, 60))
    quiet = replace(still, noise_m=0.0, flying_share=0.0, stray_share=0.0)
    one = scan(replace(scene, camera=quiet), seed=2)
    x, y, z = one.in_scene().T
    np.testing.assert_allclose(z, one.surface.z(x, y), rtol=0, atol=1e-4 * one.surface.node_m)
    with pytest.raises(DivespotError, match="stations_m holds 2 places: 3 are needed"):
        Tripod(frames=3, stations_m=((0.0, 0.0), (1.0, 0.0)))


def test_points_are_given_several_times() -> None:
    for seed in (2, 3, 4):
        one = taken("scan-twice", seed)
        _, counts = np.unique(one.points, axis=0, return_counts=True)
        assert counts.max() == one.scene.copies > 1
        assert np.mean(counts == one.scene.copies) > 0.15


def test_few_points_are_left() -> None:
    counts = [np.count_nonzero(taken("scan-few", seed).labels == 1) for seed in range(8)]
    assert min(counts) < 300
    assert all(50 < count < 3000 for count in counts)


def test_a_wet_floor_mirrors_what_stands_on_it() -> None:
    one = taken("below-mirror")
    at = one.in_scene()[one.labels == STRAY]
    low = at[at[:, 2] < -0.1 * one.surface.height_m.max()]
    above_m = one.surface.z(low[:, 0], low[:, 1])
    mirrored = np.abs(low[:, 2] + above_m) < 0.1 * one.surface.height_m.max()
    assert np.count_nonzero(mirrored) > 0.5 * np.count_nonzero(above_m > 0) > 3


def test_points_lie_far_below_the_floor_and_behind_the_surface() -> None:
    one = taken("below-strays")
    below_m = -one.in_scene()[one.labels == STRAY][:, 2]
    deep = np.count_nonzero(below_m > 0.7 * one.scene.ghosts.low_m)
    assert deep >= one.scene.ghosts.low_points
    behind = (below_m > 0.02 * one.surface.height_m.max()) & (below_m < one.scene.ghosts.low_m)
    assert np.count_nonzero(behind) > 5


@pytest.mark.parametrize("name", OF_KIND["vessel"])
def test_a_vessel_is_filled_from_wall_to_wall_within_its_outline(name: str) -> None:
    for seed in (2, 3):
        one = taken(name, seed)
        vessel, surface = one.scene.vessel, one.surface
        assert vessel is not None
        corners = np.array(vessel.outline_m)
        x, y = corners.T
        area_m2 = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
        open_nodes = (surface.owner == 1) & ~in_walls(one, surface.x, surface.y[:, None])
        assert np.count_nonzero(open_nodes) * surface.node_m**2 == pytest.approx(area_m2, rel=0.15)
        at = one.in_scene()[one.labels == 1]
        assert np.all(np.abs(at[:, :2]).max(axis=0) < np.abs(corners).max(axis=0) * 1.05)
        assert surface.ground_m[surface.owner == 1] == pytest.approx(vessel.floor_m)
