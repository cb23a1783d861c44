"""Scans of one kind each that went wrong in the field, made from formulas, with their volumes."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, radians, tan
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

Floats = NDArray[np.float64]

UTM = np.array([501_234.0, 5_402_345.0, 210.0])
NOISE_M = 0.001
#: The cone that most things stand over, hang over or reach into.
RADIUS_M, HEIGHT_M = 0.5, 0.24


@dataclass(frozen=True)
class Kind:
    """Points and the volumes of the piles in them; None where no volume may be claimed."""

    points: Floats
    truth_m3: tuple[float, ...] | None


def cone(x: Floats, y: Floats, at: tuple[float, float], radius: float, height: float) -> Floats:
    """Return the height of a cone over `x` and `y`; below nought for a pit."""
    above = np.maximum(1 - np.hypot(x - at[0], y - at[1]) / radius, 0)
    return np.asarray(height * above)


def cone_m3(radius: float, height: float) -> float:
    """Return the volume of a cone."""
    return pi * radius**2 * height / 3


def _cells(x: tuple[float, float], y: tuple[float, float], step: float) -> Floats:
    """Return the places of a raster, shape ``(n, 2)``."""
    columns, rows = np.meshgrid(np.arange(*x, step), np.arange(*y, step))
    return np.column_stack([columns.ravel(), rows.ravel()])


def _ball(rng: np.random.Generator, at: Floats, half: Floats, count: int) -> Floats:
    """Return points on an ellipsoid."""
    way = rng.normal(size=(count, 3))
    return np.asarray(at + half * way / np.linalg.norm(way, axis=1, keepdims=True))


def _noisy(rng: np.random.Generator, *parts: Floats) -> Floats:
    points = np.concatenate(parts)
    return np.asarray(points + rng.normal(0, NOISE_M, points.shape))


def _heap(x: Floats, y: Floats) -> Floats:
    return cone(x, y, (0, 0), RADIUS_M, HEIGHT_M)


def _heap_on_floor(step: float = 0.007) -> Floats:
    at = _cells((-1.1, 1.1), (-0.9, 0.9), step)
    return np.column_stack([at, _heap(at[:, 0], at[:, 1])])


def _survey(
    rng: np.random.Generator, height: Callable[[Floats, Floats], Floats], width: float = 90
) -> Floats:
    """Return a survey from the air of a square site, in UTM, with 2 cm of noise."""
    x, y = rng.uniform(0, width, (2, 45_000))
    return np.asarray(np.c_[x, y, height(x, y) + rng.normal(0, 0.02, len(x))] + UTM)


HEAP_M3 = cone_m3(RADIUS_M, HEIGHT_M)


def hovering(rng: np.random.Generator) -> Kind:
    """Return a heap with somebody's upper body over its flank."""
    body = _ball(rng, np.array([-0.2, 0.1, 0.65]), np.array([0.12, 0.18, 0.15]), 2500)
    return Kind(_noisy(rng, _heap_on_floor(), body), (HEAP_M3,))


def standing(rng: np.random.Generator) -> Kind:
    """Return a heap on which somebody stands."""

    def leg(x: float, y: float) -> Floats:
        turn = rng.uniform(0, 2 * pi, 2500)
        z = rng.uniform(_heap(np.array([x]), np.array([y]))[0] - 0.01, 0.75, 2500)
        return np.column_stack([x + 0.04 * np.cos(turn), y + 0.04 * np.sin(turn), z])

    trunk = _ball(rng, np.array([-0.15, 0.2, 0.95]), np.array([0.12, 0.2, 0.22]), 3000)
    return Kind(_noisy(rng, _heap_on_floor(), leg(-0.15, 0.1), leg(-0.15, 0.3), trunk), (HEAP_M3,))


def belt(rng: np.random.Generator) -> Kind:
    """Return a heap with the end of a conveyor 5 cm over its top."""
    along, across = rng.uniform(0, 1.1, 8000), rng.uniform(-0.09, 0.09, 8000)
    conveyor = np.c_[across, -along, HEIGHT_M + 0.05 + 0.4 * along]
    return Kind(_noisy(rng, _heap_on_floor(), conveyor), (HEAP_M3,))


def bars(rng: np.random.Generator) -> Kind:
    """Return a heap under the bars of a roof."""

    def bar(y: float) -> Floats:
        low, high = [-1.1, y - 0.02, 0.85], [1.1, y + 0.02, 0.89]
        return rng.uniform(low, high, (3500, 3))

    bars = [bar(y) for y in np.arange(-0.75, 0.8, 0.3)]
    return Kind(_noisy(rng, _heap_on_floor(), *bars), (HEAP_M3,))


def corner(rng: np.random.Generator) -> Kind:
    """Return a quarter of a cone poured into the corner of two walls."""
    height, slope = 0.36, tan(radians(30))

    def poured(x: Floats, y: Floats) -> Floats:
        return np.asarray(np.maximum(height - slope * np.hypot(x, y), 0))

    def wall(length: float) -> Floats:
        at = _cells((0, length), (0, 0.75), 0.009)
        return at[at[:, 1] > poured(at[:, 0], 0 * at[:, 0])]

    floor = _cells((0, 2.2), (0, 1.7), 0.007)
    one, other = wall(2.2), wall(1.7)
    sides = np.insert(one, 1, 0, axis=1), np.insert(other, 0, 0, axis=1)
    points = _noisy(rng, np.c_[floor, poured(*floor.T)], *sides)
    return Kind(points, (cone_m3(height / slope, height) / 4,))


def bay_wedge(rng: np.random.Generator) -> Kind:
    """Return a flat ramp from wall to wall in a bay, larger than the floor before it."""
    long, high, half = 1.7, 1.0, 1.4

    def ramp(y: Floats) -> Floats:
        return np.asarray(high * np.maximum(1 - y / long, 0))

    floor = _cells((-half, half), (0, 2.7), 0.016)
    side = _cells((0, 2.7), (0, 1.7), 0.02)
    side = side[side[:, 1] > ramp(side[:, 0])]
    back = np.insert(_cells((-half, half), (high, 1.7), 0.016), 1, 0, axis=1)
    sides = [np.insert(side, 0, x, axis=1) for x in (-half, half)]
    points = _noisy(rng, np.c_[floor, ramp(floor[:, 1])], *sides, back)
    return Kind(points, (long * high * half,))


def open_box(rng: np.random.Generator) -> Kind:
    """Return a heaped container whose sides lie in the camera's shadow."""
    at = _cells((-1.3, 1.3), (-1.1, 1.1), 0.011)
    far = np.maximum(abs(at[:, 0]) - 0.6, abs(at[:, 1]) - 0.5)
    fill = 0.4 + 0.25 * np.maximum(1 - np.hypot(at[:, 0] / 0.6, at[:, 1] / 0.5), 0)
    z = np.select([far < 0, far < 0.03], [fill, 0.42], 0.0)
    seen = (far < 0.03) | (np.maximum(abs(at[:, 0]) / 0.75, abs(at[:, 1]) / 0.64) > 1)
    return Kind(_noisy(rng, np.c_[at, z][seen]), None)


def tripod(rng: np.random.Generator) -> Kind:
    """Return a heap seen by a scanner on the ground from three sides."""

    def set_up(turn: float) -> Floats:
        place = 12 * np.array([np.cos(turn), np.sin(turn)])
        away = 1 / np.sqrt(rng.uniform(1 / 24**2, 1 / 1.5**2, 100_000))
        way = rng.uniform(0, 2 * pi, len(away))
        at = place + away[:, None] * np.c_[np.cos(way), np.sin(way)]
        side = np.hypot(*at.T)
        return np.asarray(at[(side > 4.8) | (at @ place / 12 > -0.2 * side)])

    at = np.concatenate([set_up(turn) for turn in (0.5, 2.6, 4.7)])
    z = cone(at[:, 0], at[:, 1], (0, 0), 4.8, 3.1) + rng.normal(0, 0.004, len(at))
    return Kind(np.c_[at, z], (cone_m3(4.8, 3.1),))


def pit(rng: np.random.Generator) -> Kind:
    """Return a floor with a hole in it and no heap."""
    at = _cells((-1.3, 1.3), (-1.1, 1.1), 0.011)
    hole = np.maximum(1 - (np.hypot(*at.T) / 0.45) ** 2, 0)
    return Kind(_noisy(rng, np.c_[at, -0.12 * hole]), ())


def heap_and_pit(rng: np.random.Generator) -> Kind:
    """Return a heap beside a larger pit."""

    def site(x: Floats, y: Floats) -> Floats:
        return cone(x, y, (60, 25), 8, 4.5) + cone(x, y, (25, 62), 11, -5)

    return Kind(_survey(rng, site), (cone_m3(8, 4.5),))


def terrace(rng: np.random.Generator) -> Kind:
    """Return two levels with a heap on each."""

    def site(x: Floats, y: Floats) -> Floats:
        heaps = cone(x, y, (60, 22), 7.5, 4.5) + cone(x, y, (30, 75), 6, 3.2)
        return np.asarray(heaps - np.clip((y - 50) * 0.6, 0, 4.5))

    return Kind(_survey(rng, site), (cone_m3(7.5, 4.5), cone_m3(6, 3.2)))


def ditch(rng: np.random.Generator) -> Kind:
    """Return two heaps on a yard with a ditch along one side."""

    def site(x: Floats, y: Floats) -> Floats:
        heaps = cone(x, y, (30, 30), 5.5, 2.4) + cone(x, y, (60, 60), 5, 2)
        return np.asarray(heaps - np.maximum(2.4 - abs(y - 10) * 0.8, 0))

    return Kind(_survey(rng, site), (cone_m3(5.5, 2.4), cone_m3(5, 2)))


def dock(rng: np.random.Generator) -> Kind:
    """Return a heap on a platform, and beside that a floor 1.1 m lower."""
    top, low = _cells((-1.3, 1.3), (-1.1, 1.1), 0.011), _cells((-1.3, 1.3), (1.5, 2.5), 0.011)
    heap = np.c_[top, _heap(*top.T)]
    return Kind(_noisy(rng, heap, np.insert(low, 2, -1.1, axis=1)), (HEAP_M3,))


def no_floor(rng: np.random.Generator) -> Kind:
    """Return a heap that fills the view."""
    at = _cells((-1.3, 1.3), (-1.1, 1.1), 0.011)
    return Kind(_noisy(rng, np.c_[at, cone(at[:, 0], at[:, 1], (0.1, 0), 2.6, 1.3)]), None)


def bench(rng: np.random.Generator) -> Kind:
    """Return a heap against the face of a bench 9 m high."""
    at, radius, high, foot = (33.0, 30.0), 8.0, 4.8, 29.0

    def face(y: Floats) -> Floats:
        return np.clip((y - foot - 5) * 2.75, 0, 9)

    def site(x: Floats, y: Floats) -> Floats:
        return np.maximum(face(y), cone(x, y, at, radius, high))

    fine = (np.arange(0, 60, 0.05) + 0.025, np.arange(20, 40, 0.05) + 0.025)
    x, y = np.meshgrid(*fine)
    truth = float((site(x, y) - face(y)).sum()) * 0.05**2
    return Kind(_survey(rng, site, 60), (truth,))


KINDS: Mapping[str, Callable[[np.random.Generator], Kind]] = MappingProxyType(
    {
        make.__name__: make
        for make in (
            hovering,
            standing,
            belt,
            bars,
            corner,
            bay_wedge,
            open_box,
            tripod,
            pit,
            heap_and_pit,
            terrace,
            ditch,
            dock,
            no_floor,
            bench,
        )
    }
)
