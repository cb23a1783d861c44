"""Objects that hang, fly or reach over a pile."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from divespot.simulate.solids import XYZ, Ball, Capsule, Ellipsoid, Slab
from divespot.simulate.things import XY, Hanging

if TYPE_CHECKING:
    from numpy.typing import NDArray

BODY_M = 0.32
"""Height in metres of an adult's upper body when leaning over."""


def body(low_m: XYZ, scale: float, frames: tuple[int, ...], rng: np.random.Generator) -> Hanging:
    """Trunk, head and arms of a person leaning over; `low_m` is the lowest point."""
    heading = rng.uniform(0, 2 * math.pi)

    def at(ahead: float, aside: float, up: float) -> XYZ:
        x, y = _moved(low_m[:2], heading, scale * ahead, scale * aside)
        return (x, y, low_m[2] + scale * up)

    half_axes = (0.28 * scale, 0.2 * scale, 0.14 * scale)
    trunk = Ellipsoid(at(0.0, 0.0, 0.18), half_axes, math.degrees(heading))
    head = Ball(at(0.36, 0.0, 0.2), 0.1 * scale)
    arms = (
        Capsule(at(0.15, side * 0.18, 0.16), at(0.5, side * 0.22, 0.045), 0.045 * scale)
        for side in (-1, 1)
    )
    return Hanging("body", (trunk, head, *arms), frames)


def conveyor(end_m: XYZ, size_m: float, rng: np.random.Generator) -> Hanging:
    """Return a belt and the roller at its lower end, from which it rises."""
    heading, rise = rng.uniform(0, 2 * math.pi), math.radians(rng.uniform(8, 22))
    length_m, width_m = rng.uniform(1.5, 3.0) * size_m, rng.uniform(0.1, 0.35) * size_m
    thick_m = 0.15 * width_m
    x, y = _moved(end_m[:2], heading, length_m / 2 * math.cos(rise), 0.0)
    middle = (x, y, end_m[2] + thick_m + length_m / 2 * math.sin(rise))
    belt = Slab(middle, (length_m, width_m, thick_m), math.degrees(heading), -math.degrees(rise))
    ends = (_moved(end_m[:2], heading, 0.0, side * width_m / 2) for side in (-1, 1))
    one, other = ((*end, end_m[2] + thick_m) for end in ends)
    return Hanging("conveyor", (belt, Capsule(one, other, thick_m)))


def bars(z: float, length_m: float, size_m: float, rng: np.random.Generator) -> Hanging:
    """Return parallel beams over a whole scene."""
    heading, width_m = rng.uniform(0, 180), rng.uniform(0.03, 0.1) * size_m
    gap_m = rng.uniform(0.4, 0.9) * size_m
    count = math.ceil(length_m / gap_m)
    size = (length_m, width_m, rng.uniform(0.5, 1.5) * width_m)
    beams = []
    for i in range(count):
        aside_m = (i - (count - 1) / 2) * gap_m
        middle = _moved((0.0, 0.0), math.radians(heading), 0.0, aside_m)
        beams.append(Slab((*middle, z), size, heading))
    return Hanging("bars", tuple(beams))


def lamp(low_m: XYZ, size_m: float, ceiling_m: float, rng: np.random.Generator) -> Hanging:
    """Return a lamp and the cable it hangs from."""
    radius_m = rng.uniform(0.05, 0.15) * size_m
    x, y, z = low_m
    shade = Ellipsoid((x, y, z + radius_m), (radius_m, radius_m, radius_m))
    cable = Capsule((x, y, z + radius_m), (x, y, ceiling_m), 0.01 * size_m)
    return Hanging("lamp", (shade, cable))


def bucket(lip: XY, heading: float, size_m: float, rng: np.random.Generator) -> Hanging:
    """Return a loader's bucket whose lip touches the surface, with its back to the loader."""
    length_m, width_m = rng.uniform(0.2, 0.35) * size_m, rng.uniform(0.35, 0.7) * size_m
    high_m, thick_m = 0.6 * length_m, 0.02 * size_m
    tilt = math.radians(rng.uniform(0, 30))
    turn = math.degrees(heading)

    def at(back_m: float, aside_m: float, up_m: float) -> XYZ:
        back, up = (
            back_m * math.cos(tilt) - up_m * math.sin(tilt),
            back_m * math.sin(tilt) + up_m * math.cos(tilt),
        )
        return (*_moved(lip, heading, back, aside_m), up)

    def plate(middle: XYZ, size: XYZ) -> Slab:
        return Slab(middle, size, turn, -math.degrees(tilt))

    sides = (
        plate(at(length_m / 2, side * width_m / 2, high_m / 2), (length_m, thick_m, high_m))
        for side in (-1, 1)
    )
    bottom = plate(at(length_m / 2, 0, thick_m / 2), (length_m, width_m, thick_m))
    back = plate(at(length_m, 0, high_m / 2), (thick_m, width_m, high_m))
    return Hanging("bucket", (bottom, back, *sides), rests_at_m=lip)


def bird(place: XYZ, size_m: float, frames: tuple[int, ...], rng: np.random.Generator) -> Hanging:
    """Return a bird, wings spread."""
    heading, span_m = rng.uniform(0, 360), rng.uniform(0.04, 0.12) * size_m
    wings = Ellipsoid(place, (0.35 * span_m, span_m, 0.1 * span_m), heading)
    trunk = Ellipsoid(place, (0.7 * span_m, 0.2 * span_m, 0.2 * span_m), heading)
    return Hanging("bird", (wings, trunk), frames)


def crown(low_m: XYZ, size_m: float, rng: np.random.Generator) -> Hanging:
    """Return a tree's crown: clusters of leaves with gaps between them."""
    half = np.array([0.8, 0.8, 0.4]) * rng.uniform(0.7, 1.0) * size_m
    middle = np.add(low_m, (0, 0, half[2]))
    places = middle + half * _in_ball(int(rng.integers(60, 120)), rng)
    radii_m = rng.uniform(0.03, 0.07, len(places)) * size_m
    leaves = (
        Ball((x, y, max(z, low_m[2] + radius)), radius)
        for (x, y, z), radius in zip(places.tolist(), radii_m.tolist(), strict=True)
    )
    return Hanging("crown", tuple(leaves))


def _moved(place: XY, heading: float, ahead_m: float, aside_m: float) -> XY:
    """Return a place at a distance ahead of and beside another."""
    cos, sin = math.cos(heading), math.sin(heading)
    return (
        place[0] + ahead_m * cos - aside_m * sin,
        place[1] + ahead_m * sin + aside_m * cos,
    )


def _in_ball(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw places in the ball of radius 1."""
    towards = rng.standard_normal((count, 3))
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    return np.asarray(towards * rng.random((count, 1)) ** (1 / 3))
