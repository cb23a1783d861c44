"""Scenes by name.

A name fixes the kind and volume of the piles and the view of them; the rest is drawn at random. For
the scenes of a family (`families`) everything is drawn.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot._arguments import seed_number, word
from divespot.errors import DivespotError
from divespot.simulate.draw import stream
from divespot.simulate.families import FAMILIES
from divespot.simulate.floor import Floor
from divespot.simulate.pose import Pose
from divespot.simulate.scene import Camera, Pile, Scene
from divespot.simulate.shapes import (
    RAIL_CAMERAS,
    STRIPS_M,
    Maker,
    corn,
    optical_pose,
    paper_shapes,
    shape,
    small_floor,
    unlevelled,
)
from divespot.simulate.surroundings import around
from divespot.simulate.things import Box, Rod, Wall

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np


def scene_named(name: str, seed: int = 0) -> Scene:
    """Return the scene of a name.

    Raises
    ------
    DivespotError
        If there is no such name; the message lists them.

    Examples
    --------
    >>> [round(pile.volume_m3, 3) for pile in scene_named("three-piles").piles]
    [0.035, 0.014, 0.022]

    """
    if word("name", name) not in NAMES:
        raise DivespotError(f"there is no scene {name!r}: one of {', '.join(NAMES)} is needed")
    return replace(NAMES[name](stream(seed_number(seed), f"{name} scene")), name=name)


def middling(rng: np.random.Generator) -> Scene:
    """Make the basic scene that harder ones vary: 0.028 m3 in several peaks on 2.6 m2."""
    return shape(2.6, 0.028, 2, rng)


def three_piles(rng: np.random.Generator) -> Scene:
    """Set three piles apart, of different kinds and volumes."""
    strip_m, camera = (3.4, 1.1), replace(RAIL_CAMERAS[2.6], frames=8, rail_m=2.7)
    piles = (
        corn(0.035, 2, rng, (-1.05, 0.0)),
        corn(0.014, 0, rng, (0.1, -0.05)),
        corn(0.022, 1, rng, (1.05, 0.05)),
    )
    things = around(strip_m, camera.frames, rng)
    return Scene(
        small_floor(strip_m),
        piles,
        things,
        camera,
        unlevelled(rng),
        fuse_voxel_m=0.0075,
        strip_m=strip_m,
    )


def touching_piles(rng: np.random.Generator) -> Scene:
    """Pour two cones whose feet run into each other."""
    apart_m = rng.uniform(0.56, 0.64)
    piles = (
        corn(0.03, 0, rng, (-apart_m / 2, 0.0)),
        corn(0.022, 0, rng, (apart_m / 2, rng.uniform(-0.08, 0.08))),
    )
    return replace(middling(rng), piles=piles)


def big_wall(rng: np.random.Generator) -> Scene:
    """Put a tall wall behind the pile, seen obliquely, with more points than the floor."""
    wall = Wall((-2.4, 0.9), (2.4, 0.9), height_m=2.4)
    camera = replace(RAIL_CAMERAS[2.6], offset_m=-1.0, pitch_deg=62.0)
    pile = corn(0.035, 2, rng)
    return Scene(
        Floor(5.0, 3.2),
        (pile,),
        (wall,),
        camera,
        unlevelled(rng),
        fuse_voxel_m=0.008,
        strip_m=STRIPS_M[2.6],
    )


def strays(rng: np.random.Generator) -> Scene:
    """Add 8 % outliers and 2.5 times the noise."""
    scene = middling(rng)
    camera = replace(scene.camera, noise_m=2.5 * scene.camera.noise_m, stray_share=0.08)
    return replace(scene, camera=camera)


def optical_frame(rng: np.random.Generator) -> Scene:
    """Take one tilted frame, in the camera's own frame: x right, y down, z forward."""
    camera = Camera(
        frames=1, offset_m=-0.9, pitch_deg=rng.uniform(30, 38), zero_share=0.05, stray_share=0.0005
    )
    box = Box((rng.uniform(0.45, 0.55), 0.6), (0.25, 0.2, 0.15), rng.uniform(0, 90))
    return Scene(
        Floor(4.0, 6.0, node_m=0.005),
        (corn(0.035, 2, rng, (-0.1, 0.0)),),
        (box,),
        camera,
        optical_pose(camera),
        fuse_voxel_m=0.0,
    )


def upside_down(rng: np.random.Generator) -> Scene:
    """Turn the scan upside down: up is close to -z."""
    pose = Pose(180 + rng.uniform(-8, 8), rng.uniform(-8, 8), rng.uniform(0, 360), (0.3, -0.2, 1.4))
    return replace(middling(rng), pose=pose)


def wavering_floor(rng: np.random.Generator) -> Scene:
    """Give the floor long waves of at most 6 mm up and down."""
    scene = middling(rng)
    return replace(scene, floor=replace(scene.floor, wave_m=0.006))


def folded_floor(rng: np.random.Generator) -> Scene:
    """Fold the floor: two planes meet at 3 degrees under the pile."""
    scene = middling(rng)
    edge_m = rng.uniform(-0.2, 0.2)
    return replace(scene, floor=replace(scene.floor, fold_deg=3.0, edge_m=edge_m))


def stepped_floor(rng: np.random.Generator) -> Scene:
    """Step the floor by 3 cm under the pile."""
    scene = middling(rng)
    edge_m = rng.uniform(-0.2, 0.2)
    return replace(scene, floor=replace(scene.floor, step_m=0.03, edge_m=edge_m))


def bay(rng: np.random.Generator) -> Scene:
    """Pour a pile against the back wall, often a side wall, of a bay of three walls."""
    walls = (
        Wall((-1.2, 0.8), (1.2, 0.8), 0.8, leaned_on=True),
        Wall((-1.15, -0.8), (-1.15, 0.8), 0.8, leaned_on=True),
        Wall((1.15, -0.8), (1.15, 0.8), 0.8, leaned_on=True),
    )
    pile = Pile(
        0.12, (rng.uniform(-0.7, 0.7), rng.uniform(0.35, 0.6)), peaks=2, spread=0.4, heading_deg=0.0
    )
    camera = replace(RAIL_CAMERAS[2.6], rail_m=1.2, frames=5)
    return Scene(
        Floor(5.0, 4.0, node_m=0.005), (pile,), walls, camera, unlevelled(rng), fuse_voxel_m=0.006
    )


def one_side(rng: np.random.Generator) -> Scene:
    """Look from a low position on one side, with the far flank hidden."""
    camera = Camera(
        frames=4, rail_m=0.5, height_m=0.75, offset_m=-1.7, pitch_deg=66.0, range_m=(0.2, 5.5)
    )
    return Scene(
        Floor(7.0, 7.0, node_m=0.006),
        (corn(0.05, 0, rng),),
        (),
        camera,
        unlevelled(rng),
        fuse_voxel_m=0.005,
    )


def bare_floor(rng: np.random.Generator) -> Scene:
    """Leave only the rail's supports: no pile."""
    scene = middling(rng)
    rods = tuple(thing for thing in scene.things if isinstance(thing, Rod))
    return replace(scene, piles=(), things=rods)


def sharp_box(rng: np.random.Generator) -> Scene:
    """Put a box on the floor, and no pile."""
    heading_deg = rng.uniform(0, 90)
    box = Box((0.1, 0.05), (0.45, 0.36, 0.19), heading_deg)
    return replace(shape(1.3, 0.014, 0, rng), piles=(), things=(box,))


def utm_yard(rng: np.random.Generator) -> Scene:
    """Fly over stockpiles up to 30 m wide and several metres high, in UTM coordinates."""
    stock = Pile(1.0, repose_deg=35.0, roughness_m=0.05, grain_m=0.5)
    y = rng.uniform(-4, 4, 3)
    piles = (
        replace(stock, volume_m3=2300.0, center_m=(-42.0, y[0])),
        replace(stock, volume_m3=1500.0, center_m=(0.0, y[1]), ridge=0.5, heading_deg=90.0),
        replace(stock, volume_m3=900.0, center_m=(38.0, y[2]), peaks=3, spread=0.7),
    )
    sheds = (Box((-20.0, 33.0), (14.0, 8.0, 5.0), 10.0), Box((25.0, -32.0), (6.0, 2.5, 3.0), 70.0))
    return Scene(
        Floor(170.0, 110.0, node_m=0.2, wave_m=0.08, wave_length_m=80.0, slope_deg=0.6),
        piles,
        sheds,
        aerial(height_m=70.0),
        Pose(yaw_deg=rng.uniform(0, 360), shift_m=(482310.0, 5456790.0, 312.0)),
        fuse_voxel_m=0.25,
    )


def aerial(height_m: float) -> Camera:
    """Return a drone camera: a few centimetres of noise at any height."""
    return Camera(
        frames=5,
        rail_m=80.0,
        height_m=height_m,
        range_m=(5.0, 300.0),
        noise_m=0.03,
        noise_power=0.0,
        noise_max_m=0.03,
        bias_m=0.0,
        frame_bias_m=0.01,
        shift_m=0.01,
        turn_deg=0.01,
        stray_share=0.001,
    )


def heap_10cm(rng: np.random.Generator) -> Scene:
    """Pour a heap 10 cm wide on a table, 35 cm below the camera."""
    pile = replace(corn(5.5e-5, 0, rng), roughness_m=0.0003, grain_m=0.003)
    camera = Camera(
        frames=3,
        rail_m=0.05,
        height_m=0.35,
        range_m=(0.1, 1.0),
        noise_m=0.0012,
        noise_power=1.0,
        bias_m=0.0005,
        frame_bias_m=0.0001,
        shift_m=0.0001,
        turn_deg=0.01,
    )
    return Scene(
        Floor(0.7, 0.7, node_m=0.001), (pile,), (), camera, unlevelled(rng), fuse_voxel_m=0.0012
    )


def grain_2m(rng: np.random.Generator) -> Scene:
    """Look down on a heap of wheat 2 m wide, from 2.4 m above."""
    pile = Pile(0.45, (rng.uniform(-0.1, 0.1), 0.0), repose_deg=26.0, grain_m=0.008)
    strip_m = (2.8, 2.6)
    camera = Camera(frames=5, rail_m=1.5, height_m=2.4, range_m=(0.2, 5.0))
    return Scene(
        Floor(6.5, 5.5, node_m=0.006),
        (pile,),
        around(strip_m, camera.frames, rng),
        camera,
        unlevelled(rng),
        fuse_voxel_m=0.011,
        strip_m=strip_m,
    )


NAMES: Mapping[str, Maker] = MappingProxyType(
    {
        **paper_shapes(),
        "three-piles": three_piles,
        "touching-piles": touching_piles,
        "big-wall": big_wall,
        "strays": strays,
        "optical-frame": optical_frame,
        "upside-down": upside_down,
        "wavering-floor": wavering_floor,
        "folded-floor": folded_floor,
        "stepped-floor": stepped_floor,
        "bay": bay,
        "one-side": one_side,
        "bare-floor": bare_floor,
        "sharp-box": sharp_box,
        "utm-yard": utm_yard,
        "heap-10cm": heap_10cm,
        "grain-2m": grain_2m,
        **FAMILIES,
    }
)
"""Functions that make each named scene from random draws; called by `scene_named`."""
