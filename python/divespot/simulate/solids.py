"""Solids with closed-form ray intersections."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from divespot.simulate.pose import rotation
from divespot.simulate.trace import span

Array = NDArray[np.float64]
XYZ: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class Cuboid:
    """Upright box: centre of its foot, size, heading."""

    foot_m: XYZ
    size_m: XYZ
    heading_deg: float

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        middle = np.add(self.foot_m, (0, 0, self.size_m[2] / 2))
        return middle, math.hypot(*self.size_m) / 2

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        turn = math.radians(self.heading_deg)
        own = np.array(
            [[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]]
        )
        half = np.array(self.size_m) / [2, 2, 1]
        low, high = half * [-1, -1, 0], half
        enter, leave = span((origin - self.foot_m) @ own, rays @ own, low, high)
        return np.where(enter < leave, enter, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        along, across = _own_plan(x, y, self.foot_m, self.heading_deg)
        return (np.abs(along) <= self.size_m[0] / 2) & (np.abs(across) <= self.size_m[1] / 2)


@dataclass(frozen=True)
class Cylinder:
    """Upright cylinder: centre of its foot, radius, height."""

    foot_m: XYZ
    radius_m: float
    height_m: float

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        middle = np.add(self.foot_m, (0, 0, self.height_m / 2))
        return middle, math.hypot(self.radius_m, self.height_m / 2)

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        at = origin - self.foot_m
        with np.errstate(divide="ignore", invalid="ignore"):
            side_in, side_out = _through(at, rays, self.radius_m)
            ends = [-at[2] / rays[:, 2], (self.height_m - at[2]) / rays[:, 2]]
        enter = np.maximum(side_in, np.minimum(*ends))
        leave = np.minimum(side_out, np.maximum(*ends))
        return np.where((enter < leave) & (enter > 0), enter, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        return np.hypot(x - self.foot_m[0], y - self.foot_m[1]) < self.radius_m


@dataclass(frozen=True)
class Ball:
    """A ball, given by its centre and radius."""

    middle_m: XYZ
    radius_m: float

    def ball(self) -> tuple[Array, float]:
        """Centre and radius."""
        return np.array(self.middle_m), self.radius_m

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        at = origin - self.middle_m
        towards = rays @ at
        with np.errstate(invalid="ignore"):
            near = -towards - np.sqrt(towards**2 - (at @ at - self.radius_m**2))
        return np.where(near > 0, near, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        return np.hypot(x - self.middle_m[0], y - self.middle_m[1]) < self.radius_m


@dataclass(frozen=True)
class Ellipsoid:
    """An ellipsoid: centre, half axes, heading of the first one."""

    middle_m: XYZ
    radii_m: XYZ
    heading_deg: float = 0.0

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        return np.array(self.middle_m), max(self.radii_m)

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        turn = rotation(0, 0, self.heading_deg)
        at = ((origin - self.middle_m) @ turn) / self.radii_m
        own = (rays @ turn) / self.radii_m
        length, towards = (own**2).sum(axis=1), own @ at
        with np.errstate(invalid="ignore"):
            near = (-towards - np.sqrt(towards**2 - length * (at @ at - 1))) / length
        return np.where(near > 0, near, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        along, across = _own_plan(x, y, self.middle_m, self.heading_deg)
        return (along / self.radii_m[0]) ** 2 + (across / self.radii_m[1]) ** 2 < 1


@dataclass(frozen=True)
class Capsule:
    """A round bar, cable or limb from one point to another, its ends rounded."""

    start_m: XYZ
    end_m: XYZ
    radius_m: float

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        start, end = np.array(self.start_m), np.array(self.end_m)
        return (start + end) / 2, float(np.linalg.norm(end - start)) / 2 + self.radius_m

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        ends = [Ball(end, self.radius_m).meet(origin, rays) for end in (self.start_m, self.end_m)]
        return np.minimum(self._side(origin, rays), np.minimum(*ends))

    def _side(self, origin: Array, rays: Array) -> Array:
        """Distances to the round side, between the ends."""
        bar, at = np.subtract(self.end_m, self.start_m), origin - self.start_m
        long = bar @ bar
        along, from_start = rays @ bar, at @ bar
        across = long - along**2
        towards = long * (rays @ at) - from_start * along
        beyond = long * (at @ at) - from_start**2 - long * self.radius_m**2
        with np.errstate(divide="ignore", invalid="ignore"):
            near = (-towards - np.sqrt(towards**2 - across * beyond)) / across
            place = from_start + near * along
        return np.where((near > 0) & (place > 0) & (place < long), near, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        (x0, y0, _), (dx, dy, _) = self.start_m, np.subtract(self.end_m, self.start_m)
        share = ((x - x0) * dx + (y - y0) * dy) / max(dx**2 + dy**2, 1e-12)
        share = np.clip(share, 0, 1)
        return np.asarray(np.hypot(x - x0 - share * dx, y - y0 - share * dy) < self.radius_m)


@dataclass(frozen=True)
class Slab:
    """A box in any position: centre, size, then pitch about its width and heading about z.

    A positive pitch lowers the end that the heading points to.
    """

    middle_m: XYZ
    size_m: XYZ
    heading_deg: float = 0.0
    pitch_deg: float = 0.0

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        return np.array(self.middle_m), math.hypot(*self.size_m) / 2

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        own = rotation(0, self.pitch_deg, self.heading_deg)
        half = np.array(self.size_m) / 2
        enter, leave = span((origin - self.middle_m) @ own, rays @ own, -half, half)
        return np.where((enter < leave) & (enter > 0), enter, np.inf)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        along, across = _own_plan(x, y, self.middle_m, self.heading_deg)
        length, width, thick = self.size_m
        lean = math.radians(self.pitch_deg)
        reach = (length * math.cos(lean) + thick * abs(math.sin(lean))) / 2
        return (np.abs(along) < reach) & (np.abs(across) < width / 2)


@dataclass(frozen=True)
class Arc:
    """An upright round wall: centre of its foot, inner radius, thickness, height, and its arc.

    Its two ends are open: through them the wall's inside is seen.
    """

    foot_m: XYZ
    radius_m: float
    thickness_m: float
    height_m: float
    from_deg: float
    turn_deg: float

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        middle = np.add(self.foot_m, (0, 0, self.height_m / 2))
        return middle, math.hypot(self.radius_m + self.thickness_m, self.height_m / 2)

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        at = origin - self.foot_m
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = [t for radius in self._radii() for t in _through(at, rays, radius)]
            top = (self.height_m - at[2]) / rays[:, 2]
            hits = [self._kept(t, at + t[:, None] * rays) for t in [*sides, top]]
        return np.asarray(np.minimum.reduce(hits))

    def _radii(self) -> tuple[float, float]:
        return self.radius_m, self.radius_m + self.thickness_m

    def _kept(self, distance: Array, at: Array) -> Array:
        """Distances where the intersection is on the wall, else inf."""
        low, high = self._radii()
        away, spare = np.hypot(at[:, 0], at[:, 1]), 1e-9 * high
        there = (away > low - spare) & (away < high + spare) & self._turned(at[:, 0], at[:, 1])
        there &= (at[:, 2] >= 0) & (at[:, 2] <= self.height_m * (1 + 1e-9)) & (distance > 0)
        return np.where(there, distance, np.inf)

    def _turned(self, dx: Array, dy: Array) -> NDArray[np.bool_]:
        angle = np.degrees(np.arctan2(dy, dx)) - self.from_deg
        return np.asarray(angle % 360 <= self.turn_deg)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        dx, dy = np.broadcast_arrays(x - self.foot_m[0], y - self.foot_m[1])
        low, high = self._radii()
        away = np.hypot(dx, dy)
        return np.asarray((away >= low) & (away <= high) & self._turned(dx, dy))


Part: TypeAlias = Cuboid | Cylinder | Ball | Ellipsoid | Capsule | Slab


@dataclass(frozen=True)
class Raised:
    """A solid, lifted by a height."""

    solid: Part
    by_m: float

    def ball(self) -> tuple[Array, float]:
        """Centre and radius of a ball around it."""
        middle, radius_m = self.solid.ball()
        return np.add(middle, (0, 0, self.by_m)), radius_m

    def meet(self, origin: Array, rays: Array) -> Array:
        """(n,) distances to the first intersection; inf without one."""
        return self.solid.meet(np.subtract(origin, (0, 0, self.by_m)), rays)

    def covers(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether positions in plan are under it."""
        return self.solid.covers(x, y)


def _own_plan(x: Array, y: Array, middle_m: XYZ, heading_deg: float) -> tuple[Array, Array]:
    """Positions in plan along and across a heading, from a centre."""
    turn, dx, dy = math.radians(heading_deg), x - middle_m[0], y - middle_m[1]
    along = dx * math.cos(turn) + dy * math.sin(turn)
    return along, dy * math.cos(turn) - dx * math.sin(turn)


def _through(at: Array, rays: Array, radius_m: float) -> tuple[Array, Array]:
    """Distances at which rays enter and leave an endless upright cylinder about the origin."""
    across = rays[:, 0] ** 2 + rays[:, 1] ** 2
    towards = rays[:, 0] * at[0] + rays[:, 1] * at[1]
    root = np.sqrt(towards**2 - across * (at[0] ** 2 + at[1] ** 2 - radius_m**2))
    return (-towards - root) / across, (-towards + root) / across


Solid: TypeAlias = Part | Arc | Raised
