"""A pile and a camera above it, before anything is added around them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from divespot.simulate.heap import radius_of_cone
from divespot.simulate.pose import Pose
from divespot.simulate.surroundings import boxes_around
from divespot.simulate.varied import above, apart, log_uniform, seen

if TYPE_CHECKING:
    import numpy as np

    from divespot.simulate.scene import Camera, Pile, Scene
    from divespot.simulate.things import XY, Thing

SURVEYED_M = 1.5
"""Radius in metres from which piles are surveyed in projected coordinates."""


@dataclass(frozen=True)
class Site:
    """A pile of a given radius, the strip that holds it, and the camera above."""

    size_m: float
    pile: Pile
    strip_m: XY
    camera: Camera

    @property
    def top_m(self) -> float:
        """Upper bound of the pile's height."""
        return top_of(self.pile)

    def seen_from(self, height_m: float) -> Site:
        """Return the site with its camera at least this high."""
        camera = replace(self.camera, height_m=max(self.camera.height_m, height_m))
        return replace(self, camera=camera)

    def scene(self, things: tuple[Thing, ...], rng: np.random.Generator) -> Scene:
        """Return the scene, with boxes at the ends of the strip."""
        boxes = boxes_around(self.strip_m, self.size_m, rng)
        return seen((self.pile,), (*boxes, *things), self.camera, self.strip_m, rng)


def site(rng: np.random.Generator, low_m: float, high_m: float) -> Site:
    """Pour a pile of any form, with a radius between two."""
    size_m = log_uniform(rng, low_m, high_m)
    (pile,), strip_m = apart(size_m, 1, rng)
    return Site(size_m, pile, strip_m, above(strip_m, size_m, rng))


def top_of(pile: Pile) -> float:
    """Upper bound of a pile's height on a level floor."""
    slope = math.tan(math.radians(pile.repose_deg))
    return slope * radius_of_cone(pile.volume_m3, pile.repose_deg) + 5 * pile.roughness_m


def upright(size_m: float, rng: np.random.Generator) -> Pose:
    """Draw a pose with z up: to 0.2°, as by an instrument's level, or exactly, as in a survey."""
    if size_m < SURVEYED_M:
        roll_deg, pitch_deg = rng.normal(0, 0.1, 2).clip(-0.2, 0.2)
        x, y, z = rng.uniform(-1, 1, 3)
        return Pose(roll_deg, pitch_deg, rng.uniform(0, 360), (x, y, z))
    x, y, z = rng.uniform((3e5, 2e5, 0.0), (7e5, 8e6, 900.0))
    return Pose(yaw_deg=rng.uniform(0, 360), shift_m=(x, y, z))
