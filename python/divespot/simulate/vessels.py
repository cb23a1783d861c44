"""Randomly drawn vessels seen from above, with given floor and outline."""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from divespot.simulate.floor import Floor
from divespot.simulate.level import Level
from divespot.simulate.pose import Pose
from divespot.simulate.scene import Camera, Pile, Scene
from divespot.simulate.things import XY, RoundWall, Thing
from divespot.simulate.varied import log_uniform
from divespot.simulate.vessel import Vessel
from divespot.simulate.walls import three_walls, wall_across

if TYPE_CHECKING:
    from collections.abc import Mapping

    from divespot.simulate.shapes import Maker

CORNERS = 180
"""Number of corners of the outline of a round vessel."""
SEEN_DEG = 60.0
"""Opening angle of the camera in both directions, in degrees."""


def bin_(rng: np.random.Generator) -> Scene:
    """Fill a bin whose camera hangs over it, as in its lid."""
    half_m = log_uniform(rng, 0.3, 3.0)
    return _square((half_m, half_m * rng.uniform(0.6, 1.0)), 0.0, rng)


def truck(rng: np.random.Generator) -> Scene:
    """Load the bed of a truck, which stands above the road."""
    half_m = (rng.uniform(2.0, 3.5), rng.uniform(1.1, 1.3))
    return _square(half_m, rng.uniform(0.9, 1.4), rng)


def silo(rng: np.random.Generator) -> Scene:
    """Fill a silo, seen from under its roof."""
    radius_m = log_uniform(rng, 0.5, 6.0)
    thick_m = 0.1 * radius_m
    pile, high_m = _fill(math.pi * radius_m**2, radius_m, rng)
    wall = RoundWall((0.0, 0.0), radius_m, high_m, thick_m, 0.0, 360.0)
    turns = 2 * math.pi * (np.arange(CORNERS) + 0.5) / CORNERS
    # A polygon with the circle's area.
    reach_m = radius_m * math.sqrt(2 * math.pi / CORNERS / math.sin(2 * math.pi / CORNERS))
    reach_m += _beyond(thick_m, rng)
    corners = reach_m * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    outline = tuple((x, y) for x, y in corners.tolist())
    return _from_above(pile, (wall,), Vessel(outline), high_m, rng)


def _square(half_m: XY, floor_m: float, rng: np.random.Generator) -> Scene:
    x, y = half_m
    thick_m = 0.1 * y
    pile, high_m = _fill(4 * x * y, max(half_m), rng)
    back, *sides = three_walls(x, y, 2 * y + thick_m, high_m, thick_m)
    front = wall_across(-y - thick_m, 2 * (x + thick_m), high_m, thick_m)
    right, far = x + (beyond_m := _beyond(thick_m, rng)), y + beyond_m
    vessel = Vessel(((-right, -far), (right, -far), (right, far), (-right, far)), floor_m)
    scene = _from_above(pile, (back, front, *sides), vessel, high_m + floor_m, rng)
    if floor_m == 0.0:
        return scene
    wider_m = 2 * thick_m + 0.1 * floor_m
    bed = Level((0.0, 0.0), (x + wider_m, y + wider_m), floor_m, 83.0)
    return replace(scene, floor=replace(scene.floor, levels=(bed,)))


def _beyond(thick_m: float, rng: np.random.Generator) -> float:
    """Draw how far an outline lies beyond the faces of the walls, in half of the cases 0."""
    return thick_m * max(0.0, rng.uniform(-0.9, 0.9))


def _fill(area_m2: float, reach_m: float, rng: np.random.Generator) -> tuple[Pile, float]:
    """Return a heap that covers the floor from wall to wall, and the height of the walls."""
    repose_deg, depth_m = rng.uniform(8.0, 32.0), rng.uniform(0.3, 0.9) * math.sqrt(area_m2)
    rise_m = math.tan(math.radians(repose_deg)) * reach_m
    aside_m = rng.uniform(-0.2, 0.2, 2) * reach_m
    pile = Pile(
        area_m2 * (depth_m + 0.6 * rise_m),
        (float(aside_m[0]), float(aside_m[1])),
        repose_deg,
        roughness_m=rng.uniform(0.001, 0.004) * reach_m,
        grain_m=rng.uniform(0.02, 0.05) * reach_m,
    )
    return pile, depth_m + rng.uniform(1.0, 1.5) * rise_m + 0.1 * reach_m


def _from_above(
    pile: Pile,
    walls: tuple[Thing, ...],
    vessel: Vessel,
    rim_m: float,
    rng: np.random.Generator,
) -> Scene:
    wide_m = max(x for x, _ in vessel.outline_m)
    height_m = rim_m + 1.1 * wide_m / math.tan(math.radians(SEEN_DEG) / 2) * rng.uniform(0.9, 1.3)
    sigma_m = log_uniform(rng, 0.001, 0.004) * wide_m
    camera = Camera(
        frames=int(rng.integers(1, 4)),
        rail_m=0.1 * wide_m,
        height_m=height_m,
        fov_deg=(SEEN_DEG, SEEN_DEG),
        range_m=(0.05 * wide_m, 10 * height_m),
        noise_m=sigma_m,
        noise_power=0.0,
        bias_m=0.0,
        frame_bias_m=0.3 * sigma_m,
        shift_m=0.3 * sigma_m,
        turn_deg=0.01,
        stray_share=rng.uniform(0.0, 0.003),
        noise_max_m=10 * sigma_m,
    )
    side_m = 1.5 * height_m + 0.2 * wide_m
    x, y, z = rng.uniform(-5, 5, 3)
    return Scene(
        Floor(side_m, side_m, side_m / 550),
        (pile,),
        walls,
        camera,
        Pose(yaw_deg=rng.uniform(0, 360), shift_m=(x, y, z)),
        unit_m=float(rng.choice([1.0, 1.0, 0.001])),
        fuse_voxel_m=side_m / 700,
        vessel=vessel,
    )


VESSELS: Mapping[str, Maker] = MappingProxyType(
    {"vessel-bin": bin_, "vessel-truck": truck, "vessel-silo": silo}
)
"""Functions that make each scene of a vessel."""
