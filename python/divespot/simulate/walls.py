"""Randomly drawn scenes where piles meet walls and faces.

Lengths are drawn in radii of the pile's cone, `size_m`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate.level import Level
from divespot.simulate.scene import Cut, Pile, Scene
from divespot.simulate.site import Site, site
from divespot.simulate.things import Box, RoundWall, Wall
from divespot.simulate.varied import REACH, above, log_uniform, poured, seen

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from divespot.simulate.shapes import Maker
    from divespot.simulate.things import Thing

GROWN = 1.15
"""Largest size of a pile with its middle in front of a wall, relative to its cone."""


def corner(rng: np.random.Generator) -> Scene:
    """Pour a pile into the corner of two walls."""
    size_m = log_uniform(rng, 0.1, 5.0)
    high_m, thick_m = rng.uniform(1.6, 2.0) * size_m, _thickness(size_m, rng)
    side, (x, y) = rng.choice([-1, 1]), rng.uniform(0.1, 0.5, 2) * size_m
    walls = (
        wall_across(y, 6 * size_m, high_m, thick_m),
        _along(side * x, 6 * size_m, y, high_m, thick_m),
    )
    return _in_front(size_m, poured(size_m, (0.0, 0.0), rng), walls, rng)


def bay(rng: np.random.Generator) -> Scene:
    """Pour a pile against the back wall of a bay of three, often against a side wall too."""
    size_m = log_uniform(rng, 0.1, 5.0)
    high_m, thick_m = rng.uniform(1.6, 2.0) * size_m, _thickness(size_m, rng)
    half_m, y = rng.uniform(0.9, 2.0) * size_m, rng.uniform(0.2, 0.6) * size_m
    pile = poured(size_m, (rng.uniform(-0.5, 0.5) * half_m, 0.0), rng)
    return _in_front(size_m, pile, three_walls(half_m, y, 6 * size_m, high_m, thick_m), rng)


def boards(rng: np.random.Generator) -> Scene:
    """Pour a pile against one, two or three boards that are slightly higher than the pile."""
    size_m = log_uniform(rng, 0.1, 5.0)
    pile = poured(size_m, (0.0, 0.0), rng)
    slope = math.tan(math.radians(pile.repose_deg))
    high_m = rng.uniform(1.0, 1.25) * GROWN * slope * size_m
    half_m, y = rng.uniform(0.8, 1.6) * size_m, rng.uniform(0.5, 0.8) * size_m
    thick_m, long_m = 0.5 * _thickness(size_m, rng), 6 * size_m
    _, *sides = three_walls(half_m, y, long_m, high_m, thick_m)
    walls = (wall_across(y, long_m, high_m, thick_m), *sides[: rng.integers(3)])
    return _in_front(size_m, pile, walls, rng)


def rounded(rng: np.random.Generator) -> Scene:
    """Pour a pile against the inner side of a round wall."""
    size_m = log_uniform(rng, 0.1, 5.0)
    radius_m, gap_m = rng.uniform(1.7, 3.0) * size_m, rng.uniform(0.2, 0.6) * size_m
    turn_deg = rng.uniform(220.0, 280.0)
    wall = RoundWall(
        (0.0, gap_m - radius_m),
        radius_m,
        rng.uniform(1.6, 2.0) * size_m,
        _thickness(size_m, rng),
        90.0 - turn_deg / 2,
        turn_deg,
    )
    return _in_front(size_m, poured(size_m, (0.0, 0.0), rng), (wall,), rng)


def bench(rng: np.random.Generator) -> Scene:
    """Pour a pile against the face of a bench that is higher than the pile."""
    size_m = log_uniform(rng, 0.5, 15.0)
    rise_m, toe_m = rng.uniform(1.2, 2.5) * size_m, rng.uniform(0.4, 0.9) * size_m
    face_deg = rng.uniform(60.0, 82.0)
    level = Level((0.0, toe_m + 1e3 * size_m), (math.inf, 1e3 * size_m), rise_m, face_deg)
    scene = _in_front(size_m, poured(size_m, (0.0, 0.0), rng), (), rng, rise_m)
    return replace(scene, floor=replace(scene.floor, levels=(replace(level, under_piles=True),)))


def rim(rng: np.random.Generator) -> Scene:
    """Pour a pile against the side of an open container, whose rim stands above it."""
    size_m = log_uniform(rng, 0.2, 5.0)
    y, thick_m = rng.uniform(0.4, 0.7) * size_m, rng.uniform(0.03, 0.08) * size_m
    high_m, half_m, deep_m = 1.5 * size_m, 3.0 * size_m, rng.uniform(1.0, 1.6) * size_m
    front, left, right = three_walls(half_m, y, -deep_m, high_m, thick_m)
    behind = wall_across(y + deep_m, 2 * half_m, high_m, thick_m)
    sides = (replace(wall, leaned_on=False) for wall in (left, right, behind))
    within = (2 * half_m - 3 * thick_m, deep_m - 3 * thick_m, rng.uniform(0.2, 0.9) * high_m)
    fill = Box((0.0, y + (deep_m + thick_m) / 2), within)
    pile = poured(size_m, (0.0, 0.0), rng)
    return _in_front(size_m, pile, (front, *sides, fill), rng)


def wedge(rng: np.random.Generator) -> Scene:
    """Fill a bay with a flat ramp at the angle of repose, from wall to wall."""
    long_m = log_uniform(rng, 0.2, 6.0)
    half_m, thick_m = rng.uniform(0.6, 1.2) * long_m, _thickness(long_m, rng)
    pile = poured(long_m, (0.0, 0.0), rng)
    slope = math.tan(math.radians(pile.repose_deg))
    ramp = replace(
        pile,
        volume_m3=slope * long_m**2 * half_m,
        ridge=1.2 * (half_m + thick_m) / long_m,
        heading_deg=0.0,
        skew_deg=0.0,
    )
    high_m = rng.uniform(1.3, 1.8) * slope * long_m
    walls = three_walls(half_m, 0.01 * long_m, rng.uniform(2.0, 2.5) * long_m, high_m, thick_m)
    return _in_front(long_m, ramp, walls, rng)


def face(rng: np.random.Generator) -> Scene:
    """Dig a pile out with a loader, which leaves a steep face."""
    at = site(rng, 0.5, 12.0)
    cut = Cut(rng.uniform(0, 360), rng.uniform(0.1, 0.6), rng.uniform(60.0, 80.0))
    wide_m = 1.4 * max(at.strip_m)
    camera = above((wide_m, wide_m), at.size_m, rng)
    dug = Site(at.size_m, replace(at.pile, cut=cut), (wide_m, wide_m), camera)
    return dug.scene((), rng)


def _in_front(
    size_m: float,
    pile: Pile,
    things: tuple[Thing, ...],
    rng: np.random.Generator,
    least_m: float = 0.0,
) -> Scene:
    """Look down on a pile and the wall it leans on, which makes it wider than it would be alone."""
    wide_m = 3 * REACH * size_m
    at = Site(size_m, pile, (wide_m, wide_m), above((wide_m, wide_m), size_m, rng))
    camera = at.seen_from(least_m + 2 * size_m).camera
    return seen((pile,), things, camera, at.strip_m, rng)


def _thickness(size_m: float, rng: np.random.Generator) -> float:
    return rng.uniform(0.1, 0.25) * size_m


def wall_across(face_m: float, length_m: float, high_m: float, thick_m: float) -> Wall:
    """Return a wall along x with its face at y = `face_m`."""
    y = face_m + thick_m / 2
    return Wall((-length_m / 2, y), (length_m / 2, y), high_m, thick_m, leaned_on=True)


def _along(face_m: float, length_m: float, end_m: float, high_m: float, thick_m: float) -> Wall:
    """Return a wall along y, up to y = `end_m`, with its face at x = `face_m`."""
    x = face_m + math.copysign(thick_m / 2, face_m)
    return Wall((x, end_m - length_m), (x, end_m + thick_m), high_m, thick_m, leaned_on=True)


def three_walls(
    half_m: float, back_m: float, length_m: float, high_m: float, thick_m: float
) -> tuple[Wall, Wall, Wall]:
    """Return the walls of a bay that is open towards -y: the back one and the two others."""
    back = wall_across(back_m, 2 * (half_m + thick_m), high_m, thick_m)
    left, right = (_along(x, length_m, back_m, high_m, thick_m) for x in (-half_m, half_m))
    return back, left, right


WALLS: Mapping[str, Maker] = MappingProxyType(
    {
        "walls-corner": corner,
        "walls-bay": bay,
        "walls-boards": boards,
        "walls-round": rounded,
        "walls-bench": bench,
        "walls-rim": rim,
        "walls-wedge": wedge,
    }
)
"""Functions that make each scene where a pile meets a wall."""
CUT: Mapping[str, Maker] = MappingProxyType({"cut-face": face})
"""Functions that make the scenes of piles that were dug out."""
