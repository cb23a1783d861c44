"""The solids that represent an object, and its position."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from divespot.simulate.solids import Arc, Ball, Cuboid, Cylinder, Raised, Solid
from divespot.simulate.things import XY, Box, Hanging, Person, Rod, RoundWall, Thing, Wall

if TYPE_CHECKING:
    from divespot.simulate.surface import Surface


def foot_z_m(thing: Thing, frame: int, surface: Surface) -> float:
    """Height at which an object stands: of the floor under its centre, or of the surface."""
    match thing:
        case Person(on_pile=True):
            return _lowest(place_of(thing, frame), 0.09 * thing.height_m, surface)
        case Person():
            x, y = place_of(thing, frame)
        case Wall():
            x, y = ((a + b) / 2 for a, b in zip(thing.start_m, thing.end_m, strict=True))
        case Hanging():
            return _lowest(thing.rests_at_m, 0.0, surface) if thing.rests_at_m else 0.0
        case _:
            x, y = thing.center_m
    return surface.floor_z(x, y)


def _lowest(place: XY, reach_m: float, surface: Surface) -> float:
    """Height of the surface at the lowest of four places at a distance from one."""
    x, y = np.add(place, np.array([(1, 0), (-1, 0), (0, 1), (0, -1)]) * reach_m).T
    return float(surface.z(x, y).min())


def solids_of(thing: Thing, frame: int, foot_z_m: float) -> list[Solid]:
    """Solids that represent an object in one frame."""
    match thing:
        case Wall():
            return [_wall(thing, foot_z_m)]
        case Rod():
            return [Cylinder((*thing.center_m, foot_z_m), thing.radius_m, thing.height_m)]
        case Box():
            return [Cuboid((*thing.center_m, foot_z_m), thing.size_m, thing.heading_deg)]
        case Person():
            return _person(thing, frame, foot_z_m)
        case RoundWall():
            return [_round_wall(thing, foot_z_m)]
        case Hanging():
            seen = thing.frames is None or frame in thing.frames
            return [Raised(solid, foot_z_m) for solid in thing.solids] if seen else []


def _wall(wall: Wall, foot_z_m: float) -> Cuboid:
    (x0, y0), (x1, y1) = wall.start_m, wall.end_m
    return Cuboid(
        ((x0 + x1) / 2, (y0 + y1) / 2, foot_z_m),
        (math.hypot(x1 - x0, y1 - y0), wall.thickness_m, wall.height_m),
        math.degrees(math.atan2(y1 - y0, x1 - x0)),
    )


def _round_wall(wall: RoundWall, foot_z_m: float) -> Arc:
    return Arc(
        (*wall.center_m, foot_z_m),
        wall.radius_m,
        wall.thickness_m,
        wall.height_m,
        wall.from_deg,
        wall.turn_deg,
    )


def place_of(person: Person, frame: int) -> XY:
    """Position of a person in a frame."""
    strides = frame - person.frames[0] if person.frames else 0
    (x, y), (dx, dy) = person.center_m, person.stride_m
    return x + strides * dx, y + strides * dy


def _person(person: Person, frame: int, foot_z_m: float) -> list[Solid]:
    """Two legs, one a stride ahead, a trunk and a head, in shares of the person's height."""
    if frame not in person.frames:
        return []
    tall = person.height_m
    (x, y), heading = place_of(person, frame), math.atan2(person.stride_m[1], person.stride_m[0])
    ahead = 0.09 * tall
    dx, dy = ahead * math.cos(heading + 0.5), ahead * math.sin(heading + 0.5)
    leg, trunk = 0.047 * tall, 0.10 * tall
    return [
        Cylinder((x + dx, y + dy, foot_z_m), leg, 0.5 * tall),
        Cylinder((x - dx, y - dy, foot_z_m), leg, 0.5 * tall),
        Cylinder((x, y, foot_z_m + 0.48 * tall), trunk, 0.36 * tall),
        Ball((x, y, foot_z_m + 0.93 * tall), 0.07 * tall),
    ]
