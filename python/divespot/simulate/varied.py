"""Randomly drawn scenes: size, material, number, floor, camera, pose, unit.

All lengths are drawn in radii of the largest pile, `size_m`, so that no scale is preferred; only
people and the supports of a rail have their own size.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from divespot.simulate.floor import Floor
from divespot.simulate.heap import volume_of_cone
from divespot.simulate.pose import Pose
from divespot.simulate.scene import Camera, Pile, Scene
from divespot.simulate.shapes import Maker, optical_pose, unlevelled
from divespot.simulate.surroundings import around, boxes_around
from divespot.simulate.things import XY, Thing, Wall

if TYPE_CHECKING:
    from collections.abc import Mapping

REACH = 1.6
"""Largest extent of a footprint from its centre, in radii of the cone of the same volume."""
RAIL_SIZES_M = (0.2, 0.8)
"""Range of radii of piles measured from a rail with people passing."""


def overhead(rng: np.random.Generator) -> Scene:
    """Look straight down on one to three piles that stand apart, 10 cm to 3 m wide."""
    size_m = log_uniform(rng, 0.05, 1.5)
    piles, strip_m = apart(size_m, int(rng.integers(1, 4)), rng)
    camera = above(strip_m, size_m, rng)
    on_rail = RAIL_SIZES_M[0] < size_m < RAIL_SIZES_M[1]
    things = around(strip_m, camera.frames, rng) if on_rail else boxes_around(strip_m, size_m, rng)
    return seen(piles, things, camera, strip_m, rng)


def uneven(rng: np.random.Generator) -> Scene:
    """Put one or two piles on a floor with waves, slope, fold or step, or all of them."""
    size_m = log_uniform(rng, 0.05, 5.0)
    piles, strip_m = apart(size_m, int(rng.integers(1, 3)), rng)
    camera = above(strip_m, size_m, rng)
    scene = seen(piles, boxes_around(strip_m, size_m, rng), camera, strip_m, rng)
    has = rng.random(4) < 0.5
    has[rng.integers(4)] = True
    floor = replace(
        scene.floor,
        wave_m=has[0] * rng.uniform(0.0, 0.02) * size_m,
        wave_length_m=rng.uniform(4.0, 10.0) * size_m,
        slope_deg=has[1] * rng.uniform(-3.0, 3.0),
        fold_deg=has[2] * rng.uniform(-3.0, 3.0),
        step_m=has[3] * rng.uniform(-0.1, 0.1) * size_m,
        edge_m=rng.uniform(-0.5, 0.5) * size_m,
    )
    return replace(scene, floor=floor)


def tilted(rng: np.random.Generator) -> Scene:
    """Look obliquely at a pile, with nearly all of its far flank visible."""
    size_m = log_uniform(rng, 0.05, 5.0)
    piles, strip_m = apart(size_m, 1, rng)
    camera = from_aside(above(strip_m, size_m, rng), rng.uniform(15.0, 30.0))
    return seen(piles, boxes_around(strip_m, size_m, rng), camera, strip_m, rng)


def flown(rng: np.random.Generator) -> Scene:
    """Fly over one to four stockpiles 3 to 40 m wide."""
    size_m = log_uniform(rng, 1.5, 20.0)
    piles, strip_m = apart(size_m, int(rng.integers(1, 5)), rng)
    camera = above(strip_m, size_m, rng)
    sigma_m = camera.noise_m * camera.height_m**camera.noise_power
    camera = replace(camera, noise_power=0.0, noise_m=sigma_m, bias_m=0.0)
    scene = seen(piles, boxes_around(strip_m, size_m, rng), camera, strip_m, rng)
    x, y, z = rng.uniform((3e5, 2e5, 0.0), (7e5, 8e6, 900.0))
    roll_deg, pitch_deg = rng.uniform(-1.0, 1.0, 2)
    pose = Pose(roll_deg, pitch_deg, rng.uniform(0, 360), (x, y, z))
    floor = replace(
        scene.floor,
        slope_deg=rng.uniform(0.0, 2.0),
        wave_m=rng.uniform(0.0, 0.01) * size_m,
        wave_length_m=rng.uniform(5.0, 12.0) * size_m,
    )
    return replace(scene, floor=floor, pose=pose, unit_m=float(rng.choice([1.0, 1.0, 0.3048])))


def touching(rng: np.random.Generator) -> Scene:
    """Pour two or three cones whose feet run into each other."""
    size_m = log_uniform(rng, 0.1, 10.0)
    radii_m = size_m * rng.uniform(0.7, 1.0, int(rng.integers(2, 4)))
    gaps_m = (radii_m[1:] + radii_m[:-1]) * rng.uniform(0.7, 0.85, len(radii_m) - 1)
    length_m = float(gaps_m.sum())
    places = np.concatenate([[0.0], gaps_m.cumsum()]) - length_m / 2
    repose_deg = rng.uniform(20.0, 42.0)
    piles = tuple(
        poured(radius_m, (at, rng.uniform(-0.15, 0.15) * size_m), rng, repose_deg)
        for radius_m, at in zip(radii_m.tolist(), places.tolist(), strict=True)
    )
    strip_m = (length_m + 2 * REACH * size_m, 2 * (REACH + 0.15) * size_m)
    return seen(piles, (), above(strip_m, size_m, rng), strip_m, rng)


def leaning(rng: np.random.Generator) -> Scene:
    """Pour a pile against a wall."""
    size_m = log_uniform(rng, 0.1, 5.0)
    face_m = rng.uniform(0.3, 0.7) * size_m
    thickness_m = 0.2 * size_m
    y = face_m + thickness_m / 2
    wall = Wall(
        (-4 * size_m, y),
        (4 * size_m, y),
        rng.uniform(1.6, 2.0) * size_m,
        thickness_m,
        leaned_on=True,
    )
    pile = poured(size_m, (0.0, 0.0), rng)
    # Material cut off by the wall is on this side of it: the pile is wider than it would be alone.
    strip_m = (3 * REACH * size_m, 3 * REACH * size_m)
    return seen((pile,), (wall,), above(strip_m, size_m, rng), strip_m, rng)


def from_one_side(rng: np.random.Generator) -> Scene:
    """Look from a low position on one side of a pile, with its far flank hidden."""
    size_m = log_uniform(rng, 0.05, 5.0)
    pile = poured(size_m, (0.0, 0.0), rng)
    strip_m = (2 * REACH * size_m, 2 * REACH * size_m)
    low = replace(above(strip_m, size_m, rng), height_m=rng.uniform(1.4, 2.2) * size_m)
    away_m = rng.uniform(3.0, 4.0) * size_m
    camera = from_aside(low, math.degrees(math.atan(away_m / low.height_m)))
    scene = seen((pile,), (), camera, strip_m, rng)
    return replace(scene, floor=Floor(14 * size_m, 14 * size_m, 0.015 * size_m))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number uniformly on a logarithmic scale."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def poured(
    radius_m: float, center_m: XY, rng: np.random.Generator, repose_deg: float | None = None
) -> Pile:
    """Pour a cone of any material."""
    repose = rng.uniform(20.0, 42.0) if repose_deg is None else repose_deg
    return Pile(
        volume_of_cone(radius_m, repose),
        center_m,
        repose,
        roughness_m=rng.uniform(0.001, 0.005) * radius_m,
        grain_m=rng.uniform(0.02, 0.06) * radius_m,
    )


def apart(size_m: float, count: int, rng: np.random.Generator) -> tuple[tuple[Pile, ...], XY]:
    """Pour piles of any form in a row, with their feet apart; return also the strip."""
    radii_m = [size_m, *(size_m * rng.uniform(0.6, 1.0, count - 1)).tolist()]
    gaps_m = [*(size_m * rng.uniform(0.1, 0.8, count - 1)).tolist(), 0.0]
    length_m = 2 * REACH * sum(radii_m) + sum(gaps_m)
    piles, x = [], -length_m / 2
    for radius_m, gap_m in zip(rng.permutation(radii_m).tolist(), gaps_m, strict=True):
        middle = (x + REACH * radius_m, rng.uniform(-0.1, 0.1) * size_m)
        piles.append(in_form(poured(radius_m, middle, rng), rng))
        x += 2 * REACH * radius_m + gap_m
    return tuple(piles), (length_m, 2 * (REACH + 0.1) * size_m)


def in_form(pile: Pile, rng: np.random.Generator) -> Pile:
    """Turn a cone into a ridge or a group of peaks, or leave it unchanged."""
    match rng.integers(3):
        case 0:
            return pile
        case 1:
            return replace(pile, ridge=rng.uniform(0.2, 0.5))
        case _:
            peaks = int(rng.integers(2, 4))
            return replace(pile, peaks=peaks, spread=rng.uniform(0.3, 0.5))


def above(strip_m: XY, size_m: float, rng: np.random.Generator) -> Camera:
    """Make a camera that sees a strip and some floor around it from above."""
    height_m = (strip_m[1] / 2 + 0.5 * size_m) * rng.uniform(1.3, 1.9)
    rail_m = max(0.2 * height_m, strip_m[0] + size_m - height_m)
    sigma_m = log_uniform(rng, 0.001, 0.008) * size_m
    power = rng.uniform(0.0, 2.0)
    return Camera(
        frames=max(3, math.ceil(rail_m / (0.6 * height_m)) + 1),
        rail_m=rail_m,
        height_m=height_m,
        range_m=(0.05 * height_m, 6 * height_m),
        noise_m=sigma_m / height_m**power,
        noise_power=power,
        noise_max_m=10 * sigma_m,
        bias_m=rng.uniform(-2.0, 2.0) * sigma_m,
        frame_bias_m=0.6 * sigma_m,
        shift_m=0.6 * sigma_m,
        turn_deg=math.degrees(0.6 * sigma_m / height_m),
        stray_share=rng.uniform(0.0, 0.01),
    )


def from_aside(camera: Camera, pitch_deg: float) -> Camera:
    """Turn a camera and move it aside, so that it still looks at the middle."""
    away_m = camera.height_m * math.tan(math.radians(pitch_deg))
    return replace(camera, pitch_deg=pitch_deg, offset_m=-away_m)


def seen(
    piles: tuple[Pile, ...],
    things: tuple[Thing, ...],
    camera: Camera,
    strip_m: XY,
    rng: np.random.Generator,
) -> Scene:
    """Return the scene in any pose and unit, with about 150,000 to 500,000 points."""
    size_m = camera.height_m
    view_m = (camera.rail_m + 1.4 * size_m, 1.7 * size_m)
    node_m = math.sqrt(view_m[0] * view_m[1] / 3e5)
    points = log_uniform(rng, 1.5e5, 5e5)
    return Scene(
        Floor(*view_m, node_m),
        piles,
        things,
        camera,
        any_pose(camera, rng),
        unit_m=float(rng.choice([1.0, 1.0, 1.0, 0.01, 0.001])),
        fuse_voxel_m=math.sqrt(view_m[0] * view_m[1] / points),
        strip_m=strip_m,
    )


def any_pose(camera: Camera, rng: np.random.Generator) -> Pose:
    """Draw a pose: up is close to z or to -z, or z is the camera's viewing direction."""
    levelled = unlevelled(rng)
    match rng.integers(5):
        case 0:
            return optical_pose(camera)
        case 1:
            return replace(levelled, roll_deg=180 + levelled.roll_deg)
        case _:
            return levelled


VARIED: Mapping[str, Maker] = MappingProxyType(
    {
        "varied-overhead": overhead,
        "varied-uneven": uneven,
        "varied-tilted": tilted,
        "varied-flown": flown,
        "varied-touching": touching,
        "varied-leaning": leaning,
        "varied-one-side": from_one_side,
    }
)
"""Functions that make each randomly drawn scene."""
