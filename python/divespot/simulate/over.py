"""Randomly drawn scenes with something over or on the piles.

Lengths are drawn in radii of the largest pile, `size_m`; only people have their own size.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate import hung
from divespot.simulate.ghosts import Dust, Ghosts
from divespot.simulate.heap import radius_of_cone
from divespot.simulate.shapes import ROWS, Maker, shape
from divespot.simulate.site import Site, site, top_of
from divespot.simulate.things import XY, Hanging, Person, Rod
from divespot.simulate.varied import log_uniform

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from divespot.simulate.scene import Pile, Scene

TALLEST_M = 1.9
"""Height in metres of the tallest person who walks over piles."""
HEADROOM_M = 0.6
"""Least height in metres of the lens above a person's head."""
SHAPE_BODY = 0.6
"""Size of the head and shoulders over one of the paper's shapes, relative to an adult's."""


def person(rng: np.random.Generator) -> Scene:
    """Lean an upper body over the pile without touching it, in some frames or in all."""
    at = site(rng, 0.3, 1.5)
    frames = _some_frames(at.camera.frames, rng)
    scale = min(1.0, at.size_m)
    low_m = at.top_m + rng.uniform(0.1, 0.6) * scale
    body = hung.body((*_spot(at.pile, 0.6, rng), low_m), scale, frames, rng)
    return at.seen_from(low_m + scale * (hung.BODY_M + HEADROOM_M)).scene((body,), rng)


def standing(rng: np.random.Generator) -> Scene:
    """Let somebody stand on the pile, in some frames or in all."""
    at = site(rng, 0.8, 5.0)
    frames = _some_frames(at.camera.frames, rng)
    place = _spot(at.pile, 0.6, rng)
    turn = rng.uniform(0, 2 * math.pi)
    # A standing person has a heading, and a stride of almost zero.
    stride = (1e-6 * math.cos(turn), 1e-6 * math.sin(turn))
    return _under_people(at).scene((_man(place, stride, frames, rng),), rng)


def walking(rng: np.random.Generator) -> Scene:
    """Let one or two people walk over the pile, at another place in each of several frames."""
    at = _under_people(site(rng, 0.8, 5.0))
    camera = replace(at.camera, frames=max(6, at.camera.frames))
    people = []
    for _ in range(rng.integers(1, 3)):
        seen_in = _run_of_frames(camera.frames, rng)
        heading = rng.uniform(0, 2 * math.pi)
        stride_m = rng.uniform(0.5, 1.2) * at.size_m / len(seen_in)
        stride = (stride_m * math.cos(heading), stride_m * math.sin(heading))
        x, y = _spot(at.pile, 0.3, rng)
        back = (len(seen_in) - 1) / 2
        start = (x - back * stride[0], y - back * stride[1])
        people.append(_man(start, stride, seen_in, rng))
    return replace(at, camera=camera).scene(tuple(people), rng)


def conveyor(rng: np.random.Generator) -> Scene:
    """End a conveyor over the top, within a fifth of the pile's radius of it."""
    at = site(rng, 0.1, 10.0)
    end = (*_spot(at.pile, 0.2, rng), at.top_m + rng.uniform(0.02, 0.2) * at.size_m)
    return at.scene((hung.conveyor(end, at.size_m, rng),), rng)


def bars(rng: np.random.Generator) -> Scene:
    """Stretch roof bars across the whole scene, between camera and pile."""
    at = site(rng, 0.2, 10.0)
    z = rng.uniform(at.top_m + 0.15 * at.size_m, 0.75 * at.camera.height_m)
    # As far as the camera sees at that height.
    length_m = 1.7 * (at.camera.height_m - z) + at.camera.rail_m
    return at.scene((hung.bars(z, length_m, at.size_m, rng),), rng)


def lamp(rng: np.random.Generator) -> Scene:
    """Hang a lamp on its cable over the pile."""
    at = site(rng, 0.1, 5.0)
    x, y = _spot(at.pile, 0.5, rng)
    # The cable goes up beside the rail, not through the lens.
    y = math.copysign(max(abs(y), 0.2 * at.size_m), y)
    z = at.top_m + rng.uniform(0.15, 0.5) * at.size_m
    return at.scene((hung.lamp((x, y, z), at.size_m, at.camera.height_m, rng),), rng)


def bucket(rng: np.random.Generator) -> Scene:
    """Let a loader's bucket touch the pile with its lip."""
    at = site(rng, 0.3, 10.0)
    (x, y), heading = at.pile.center_m, rng.uniform(0, 2 * math.pi)
    far_m = rng.uniform(0.35, 0.8) * at.size_m
    place = (x + far_m * math.cos(heading), y + far_m * math.sin(heading))
    return at.scene((hung.bucket(place, heading, at.size_m, rng),), rng)


def birds(rng: np.random.Generator) -> Scene:
    """Let birds fly over the pile, each in a frame or two."""
    at = site(rng, 0.5, 10.0)
    things = []
    for _ in range(rng.integers(4, 16)):
        x, y = _spot(at.pile, 0.8, rng)
        z = rng.uniform(at.top_m + 0.1 * at.size_m, 0.8 * at.camera.height_m)
        first = int(rng.integers(at.camera.frames))
        frames = tuple(range(first, min(first + int(rng.integers(1, 3)), at.camera.frames)))
        things.append(hung.bird((x, y, z), at.size_m, frames, rng))
    return at.scene(tuple(things), rng)


def rain(rng: np.random.Generator) -> Scene:
    """Let it rain, and let dust hang over the pile."""
    at = site(rng, 0.1, 10.0)
    size_m = at.size_m
    middle = (*_spot(at.pile, 0.4, rng), at.top_m + rng.uniform(0.0, 0.5) * size_m)
    cloud = Dust(middle, rng.uniform(0.2, 0.5) * size_m, rng.uniform(0.02, 0.3) / size_m)
    ghosts = Ghosts(rain_share=log_uniform(rng, 0.002, 0.03), dust=(cloud,))
    return replace(at.scene((), rng), ghosts=ghosts)


def tree(rng: np.random.Generator) -> Scene:
    """Stand a tree beside the pile, with its crown over a part of it."""
    at = site(rng, 0.5, 10.0)
    size_m, side = at.size_m, rng.choice([-1, 1])
    x, y = at.pile.center_m[0], side * (at.strip_m[1] / 2 + 0.1 * size_m)
    bottom_m = at.top_m + rng.uniform(0.1, 0.3) * size_m
    crown = hung.crown((x, y - side * 0.6 * size_m, bottom_m), size_m, rng)
    trunk = Rod((x, y), rng.uniform(0.04, 0.08) * size_m, bottom_m + 0.4 * size_m)
    return at.seen_from(1.6 * bottom_m + size_m).scene((trunk, crown), rng)


def shape_under_body(area_m2: float, volume_m3: float, kind: int) -> Maker:
    """Return a maker of one of the paper's shapes with an upper body over it."""

    def make(rng: np.random.Generator) -> Scene:
        scene = shape(area_m2, volume_m3, kind, rng)
        return replace(scene, things=(*scene.things, somebody_over(scene, 0.6, rng)))

    return make


def somebody_over(scene: Scene, within: float, rng: np.random.Generator) -> Hanging:
    """Lean a person over the first pile, within a share of its radius, in a few frames.

    Only head, shoulders and arms are visible, since the rail of the paper's shapes is at their
    height.
    """
    pile = scene.piles[0]
    frames = _run_of_frames(scene.camera.frames, rng)
    low = (*_spot(pile, within, rng), top_of(pile) + rng.uniform(0.05, 0.3))
    return hung.body(low, SHAPE_BODY, frames, rng)


def _under_people(at: Site) -> Site:
    """Raise the camera above a person standing on the top."""
    return at.seen_from(at.top_m + TALLEST_M + HEADROOM_M)


def _man(place: XY, stride: XY, frames: tuple[int, ...], rng: np.random.Generator) -> Person:
    return Person(place, stride, frames, rng.uniform(1.6, TALLEST_M), on_pile=True)


def _spot(pile: Pile, within: float, rng: np.random.Generator) -> XY:
    """Draw a place over a pile, within a share of its radius."""
    far_m = within * radius_of_cone(pile.volume_m3, pile.repose_deg) * math.sqrt(rng.random())
    turn = rng.uniform(0, 2 * math.pi)
    x, y = pile.center_m
    return x + far_m * math.cos(turn), y + far_m * math.sin(turn)


def _some_frames(count: int, rng: np.random.Generator) -> tuple[int, ...]:
    """Draw frames; in one of four cases, all of them."""
    if rng.random() < 0.25:
        return tuple(range(count))
    return _run_of_frames(count, rng)


def _run_of_frames(count: int, rng: np.random.Generator) -> tuple[int, ...]:
    """Draw consecutive frames, at most half of them."""
    length = int(rng.integers(1, count // 2 + 1))
    first = int(rng.integers(0, max(1, count - length + 1)))
    return tuple(range(first, min(first + length, count)))


OVER: Mapping[str, Maker] = MappingProxyType(
    {
        "over-person": person,
        "over-standing": standing,
        "over-walking": walking,
        "over-conveyor": conveyor,
        "over-bars": bars,
        "over-lamp": lamp,
        "over-bucket": bucket,
        "over-birds": birds,
        "over-rain": rain,
        "over-tree": tree,
    }
)
"""Functions that make each scene with something over the pile."""
BODY: Mapping[str, Maker] = MappingProxyType(
    {name.replace("shape", "body"): shape_under_body(*row) for name, row in ROWS.items()}
)
"""The same for the paper's shapes with a body over the pile."""
