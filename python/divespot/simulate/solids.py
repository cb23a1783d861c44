"""Things that stand on the floor, as solids that rays meet in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from divespot.simulate.scene import XY, XYZ, Box, Person, Rod, Thing, Wall
from divespot.simulate.trace import span

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cuboid:
    """Upright box: middle of its foot, size, heading."""

    foot_m: XYZ
    size_m: XYZ
    heading_deg: float

    def ball(self) -> tuple[Array, float]:
        """Middle and radius of a ball around it."""
        middle = np.add(self.foot_m, (0, 0, self.size_m[2] / 2))
        return middle, math.hypot(*self.size_m) / 2

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first meeting; inf without one."""
        turn = math.radians(self.heading_deg)
        own = np.array(
            [[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]]
        )
        half = np.array(self.size_m) / [2, 2, 1]
        low, high = half * [-1, -1, 0], half
        enter, leave = span((origin - self.foot_m) @ own, rays @ own, low, high)
        return np.where(enter < leave, enter, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Which places in plan lie under it."""
        turn = math.radians(self.heading_deg)
        dx, dy = x - self.foot_m[0], y - self.foot_m[1]
        along = np.abs(dx * math.cos(turn) + dy * math.sin(turn))
        across = np.abs(dy * math.cos(turn) - dx * math.sin(turn))
        return (along <= self.size_m[0] / 2) & (across <= self.size_m[1] / 2)


@dataclass(frozen=True)
class Cylinder:
    """Upright cylinder: middle of its foot, radius, height."""

    foot_m: XYZ
    radius_m: float
    height_m: float

    def ball(self) -> tuple[Array, float]:
        """Middle and radius of a ball around it."""
        middle = np.add(self.foot_m, (0, 0, self.height_m / 2))
        return middle, math.hypot(self.radius_m, self.height_m / 2)

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first meeting; inf without one."""
        at = origin - self.foot_m
        across = rays[:, 0] ** 2 + rays[:, 1] ** 2
        towards = rays[:, 0] * at[0] + rays[:, 1] * at[1]
        beyond = at[0] ** 2 + at[1] ** 2 - self.radius_m**2
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(towards**2 - across * beyond)
            side_in, side_out = (-towards - root) / across, (-towards + root) / across
            ends = [-at[2] / rays[:, 2], (self.height_m - at[2]) / rays[:, 2]]
        enter = np.maximum(side_in, np.minimum(*ends))
        leave = np.minimum(side_out, np.maximum(*ends))
        return np.where((enter < leave) & (enter > 0), enter, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Which places in plan lie under it."""
        return np.hypot(x - self.foot_m[0], y - self.foot_m[1]) < self.radius_m


@dataclass(frozen=True)
class Ball:
    """A ball, given by its middle."""

    middle_m: XYZ
    radius_m: float

    def ball(self) -> tuple[Array, float]:
        """Middle and radius."""
        return np.array(self.middle_m), self.radius_m

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first meeting; inf without one."""
        at = origin - self.middle_m
        towards = rays @ at
        with np.errstate(invalid="ignore"):
            near = -towards - np.sqrt(towards**2 - (at @ at - self.radius_m**2))
        return np.where(near > 0, near, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Which places in plan lie under it."""
        return np.hypot(x - self.middle_m[0], y - self.middle_m[1]) < self.radius_m


Solid: TypeAlias = Cuboid | Cylinder | Ball


def solids_of(thing: Thing, frame: int, foot_z_m: float) -> list[Solid]:
    """Solids that stand for a thing in one frame."""
    match thing:
        case Wall():
            return [_wall(thing, foot_z_m)]
        case Rod():
            return [Cylinder((*thing.center_m, foot_z_m), thing.radius_m, thing.height_m)]
        case Box():
            return [Cuboid((*thing.center_m, foot_z_m), thing.size_m, thing.heading_deg)]
        case Person():
            return _person(thing, frame, foot_z_m)


def _wall(wall: Wall, foot_z_m: float) -> Cuboid:
    (x0, y0), (x1, y1) = wall.start_m, wall.end_m
    return Cuboid(
        ((x0 + x1) / 2, (y0 + y1) / 2, foot_z_m),
        (math.hypot(x1 - x0, y1 - y0), wall.thickness_m, wall.height_m),
        math.degrees(math.atan2(y1 - y0, x1 - x0)),
    )


def place_of(person: Person, frame: int) -> XY:
    """Where a person stands in a frame."""
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
