"""Randomly drawn scenes with ground on several levels.

Lengths are drawn in radii of the largest pile, `size_m`. Up is close to z, since in a scan turned
upside down a pit looks like a heap.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate.level import Level
from divespot.simulate.site import Site, upright
from divespot.simulate.varied import REACH, above, in_form, log_uniform, poured, seen

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np

    from divespot.simulate.scene import Pile, Scene
    from divespot.simulate.shapes import Maker
    from divespot.simulate.things import XY

UPRIGHT_DEG = 83.0
"""Angle in degrees of faces that are meant to be upright; steeper ones slow down ray tracing."""
ENDLESS = 1e3
"""Half the length of a level without an end in view, in radii of a pile."""


def terrace(rng: np.random.Generator) -> Scene:
    """Pour a pile below a terrace and often another one on it."""
    size_m = log_uniform(rng, 0.2, 15.0)
    rise_m, face_deg = rng.uniform(0.3, 2.0) * size_m, rng.uniform(30.0, 80.0)
    run_m = rise_m / math.tan(math.radians(face_deg))
    apart_m = (REACH + rng.uniform(0.1, 0.5)) * size_m
    piles = [_pile(size_m, (-apart_m, 0.0), rng)]
    if rng.random() < 0.7:
        piles.append(_pile(0.8 * size_m, (apart_m + run_m, 0.0), rng))
    strip_m = (2 * (apart_m + run_m + REACH * size_m), 4 * size_m)
    upper = _beyond(0.0, size_m, rise_m, face_deg)
    return _yard(size_m, piles, strip_m, (upper,), rng)


def ditch(rng: np.random.Generator) -> Scene:
    """Pour a pile on each side of a ditch, or on one side only."""
    size_m = log_uniform(rng, 0.2, 15.0)
    half_m, depth_m = rng.uniform(0.3, 1.2) * size_m, rng.uniform(0.2, 1.0) * size_m
    gap_m = half_m + (REACH + rng.uniform(0.1, 0.6)) * size_m
    piles = [_pile(size_m, (side * gap_m, 0.0), rng) for side in (-1, 1)][: rng.integers(1, 3)]
    trench = Level((0.0, 0.0), (math.inf, half_m), -depth_m, rng.uniform(35.0, 80.0), 90.0)
    return _yard(size_m, piles, (2 * gap_m + 3.4 * size_m, 4 * size_m), (trench,), rng)


def sump(rng: np.random.Generator) -> Scene:
    """Sink a sump with upright sides beside a pile."""
    size_m = log_uniform(rng, 0.2, 10.0)
    half_m = (rng.uniform(0.2, 0.6) * size_m, rng.uniform(0.2, 0.6) * size_m)
    depth_m = rng.uniform(0.3, 1.0) * size_m
    hole = Level(_beside(size_m, 0.9, rng), half_m, -depth_m, UPRIGHT_DEG, 0.0, rng.random() < 0.5)
    return _yard(size_m, [_pile(size_m, (0.0, 0.0), rng)], _wide(size_m), (hole,), rng)


def hatch(rng: np.random.Generator) -> Scene:
    """Open a hatch beside a pile, through which a floor far below is seen."""
    size_m = log_uniform(rng, 0.2, 5.0)
    half_m = (rng.uniform(0.5, 1.0) * size_m, rng.uniform(0.5, 1.0) * size_m)
    # Nearly below the rail, so that the floor is seen.
    x = rng.choice([-1, 1]) * ((REACH + rng.uniform(0.1, 0.4)) * size_m + half_m[0])
    depth_m = rng.uniform(1.0, 2.5) * size_m
    hole = Level((x, rng.uniform(-0.5, 0.5) * size_m), half_m, -depth_m, UPRIGHT_DEG)
    return _yard(size_m, [_pile(size_m, (0.0, 0.0), rng)], _wide(size_m), (hole,), rng)


def pit(rng: np.random.Generator) -> Scene:
    """Dig a pit beside a heap, often larger than the heap."""
    size_m = log_uniform(rng, 0.2, 15.0)
    radius_m, face_deg = rng.uniform(0.6, 1.6) * size_m, rng.uniform(20.0, 45.0)
    depth_m = rng.uniform(0.5, 1.0) * radius_m * math.tan(math.radians(face_deg))
    place = _beside(size_m, 1.7, rng)
    hole = Level(place, (radius_m, radius_m), -depth_m, face_deg, rounded=True)
    return _yard(size_m, [_pile(size_m, (0.0, 0.0), rng)], _wide(size_m), (hole,), rng)


def pit_alone(rng: np.random.Generator) -> Scene:
    """Dig a pit where there is no pile."""
    scene = pit(rng)
    (hole,) = scene.floor.levels
    middle = replace(hole, center_m=(0.0, 0.0))
    return replace(scene, piles=(), floor=replace(scene.floor, levels=(middle,)))


def platform(rng: np.random.Generator) -> Scene:
    """Pour a pile on a table, platform or dock, lower floor around or beside it."""
    size_m = log_uniform(rng, 0.1, 5.0)
    half_m = (rng.uniform(1.8, 2.6) * size_m, rng.uniform(1.8, 2.6) * size_m)
    rise_m = rng.uniform(0.5, 3.0) * size_m
    if rng.random() < 0.5:
        top = Level((0.0, 0.0), half_m, rise_m, UPRIGHT_DEG)
    else:
        top = _beyond(-half_m[0], size_m, rise_m, UPRIGHT_DEG)
    return _yard(size_m, [_pile(size_m, (0.0, 0.0), rng)], _wide(size_m), (top,), rng)


def slab(rng: np.random.Generator) -> Scene:
    """Pour a pile on a slab that is little wider than the pile, and low."""
    size_m = log_uniform(rng, 0.5, 10.0)
    half_m = (rng.uniform(1.3, 2.0) * size_m, rng.uniform(1.3, 2.0) * size_m)
    top = Level((0.0, 0.0), half_m, rng.uniform(0.1, 0.4) * size_m, UPRIGHT_DEG)
    return _yard(size_m, [_pile(size_m, (0.0, 0.0), rng)], _wide(size_m), (top,), rng)


def bowl(rng: np.random.Generator) -> Scene:
    """Pour a pile in a quarry's bowl."""
    size_m = log_uniform(rng, 1.5, 15.0)
    face_deg, depth_m = rng.uniform(35.0, 70.0), rng.uniform(0.8, 2.0) * size_m
    run_m = depth_m / math.tan(math.radians(face_deg))
    radius_m = run_m + rng.uniform(1.8, 2.5) * size_m
    hole = Level((0.0, 0.0), (radius_m, radius_m), -depth_m, face_deg, rounded=True)
    wide_m = 2 * radius_m + size_m
    return _yard(size_m, [_pile(size_m, (0.0, 0.0), rng)], (wide_m, wide_m), (hole,), rng)


def slope(rng: np.random.Generator) -> Scene:
    """Pour a pile on a slope."""
    size_m = log_uniform(rng, 0.2, 15.0)
    pile = poured(size_m, (0.0, 0.0), rng, rng.uniform(30.0, 42.0))
    scene = _yard(size_m, [pile], (5 * size_m, 5 * size_m), (), rng)
    slope_deg = rng.choice([-1, 1]) * rng.uniform(3.0, 12.0)
    return replace(scene, floor=replace(scene.floor, slope_deg=slope_deg))


def step(rng: np.random.Generator) -> Scene:
    """Let the ground rise by a step under the pile."""
    size_m = log_uniform(rng, 0.1, 10.0)
    edge_m, rise_m = rng.uniform(-0.6, 0.6) * size_m, rng.uniform(0.05, 0.2) * size_m
    upper = replace(_beyond(edge_m, size_m, rise_m, 85.0), under_piles=True)
    pile = _pile(size_m, (0.0, 0.0), rng)
    return _yard(size_m, [pile], (5 * size_m, 5 * size_m), (upper,), rng)


def rolling(rng: np.random.Generator) -> Scene:
    """Pour a pile on rolling ground."""
    size_m = log_uniform(rng, 0.5, 15.0)
    pile = poured(size_m, (0.0, 0.0), rng, rng.uniform(30.0, 42.0))
    scene = _yard(size_m, [pile], _wide(size_m), (), rng)
    length_m = rng.uniform(5.0, 12.0) * size_m
    wave_m = rng.uniform(0.01, 0.03) * length_m
    return replace(scene, floor=replace(scene.floor, wave_m=wave_m, wave_length_m=length_m))


def _pile(radius_m: float, center_m: XY, rng: np.random.Generator) -> Pile:
    return in_form(poured(radius_m, center_m, rng), rng)


def _wide(size_m: float) -> XY:
    return (7 * size_m, 6 * size_m)


def _beside(size_m: float, half: float, rng: np.random.Generator) -> XY:
    """Draw a place for an object of a given half width that keeps clear of the pile."""
    far_m = (REACH + half * rng.uniform(1.0, 1.2)) * size_m
    turn = rng.uniform(0, 2 * math.pi)
    return far_m * math.cos(turn), far_m * math.sin(turn)


def _beyond(edge_m: float, size_m: float, rise_m: float, face_deg: float) -> Level:
    """Return a level that begins at x = `edge_m` and does not end."""
    return Level((edge_m + ENDLESS * size_m, 0.0), (ENDLESS * size_m, math.inf), rise_m, face_deg)


def _yard(
    size_m: float,
    piles: Sequence[Pile],
    strip_m: XY,
    levels: tuple[Level, ...],
    rng: np.random.Generator,
) -> Scene:
    """Look down on piles and on the levels around them."""
    highest_m = max([0.0, *(level.rise_m for level in levels)])
    at = Site(size_m, piles[0], strip_m, above(strip_m, size_m, rng))
    camera = at.seen_from(at.camera.height_m + highest_m).camera
    scene = seen(tuple(piles), (), camera, strip_m, rng)
    floor = replace(scene.floor, levels=levels)
    return replace(scene, floor=floor, pose=upright(size_m, rng))


LEVELS: Mapping[str, Maker] = MappingProxyType(
    {
        "levels-terrace": terrace,
        "levels-ditch": ditch,
        "levels-sump": sump,
        "levels-hatch": hatch,
        "levels-pit": pit,
        "levels-pit-alone": pit_alone,
        "levels-platform": platform,
        "levels-slab": slab,
        "levels-bowl": bowl,
        "levels-slope": slope,
        "levels-step": step,
        "levels-rolling": rolling,
    }
)
"""Functions that make each scene with ground on several levels."""
