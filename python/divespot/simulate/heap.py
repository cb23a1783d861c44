"""Heaps at the angle of repose, scaled to an exact volume."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Callable

    from divespot.simulate.scene import Pile
    from divespot.simulate.things import Wall

Array = NDArray[np.float64]

TIP = 0.06
"""Radius to which a tip is rounded, in radii of the cone of the same volume."""
LOBES = 0.07
"""Largest share by which one of three lobes stretches a cone. With (1 + 4 + 9) LOBES below 1 the
stretched flank is nowhere steeper than the cone (Cauchy-Schwarz on its gradient)."""


@dataclass(frozen=True)
class Plan:
    """Where a pile may lie on the nodes, and the weights that integrate it there.

    `weight_x` and `weight_y` are the integrals of the nodes' hat functions over the open side of
    the walls leaned on, so the sum of weight times height is the bilinear surface's exact volume.
    `fade_x` and `fade_y` lower the pile to nothing inside those walls.
    """

    x: Array
    y: Array
    weight_x: Array
    weight_y: Array
    fade_x: Array
    fade_y: Array

    def volume_m3(self, height_m: Array) -> float:
        """Exact integral of the bilinear surface, outside the walls."""
        return float(self.weight_y @ height_m @ self.weight_x)


def plan(x: Array, y: Array, pile: Pile, walls: list[Wall]) -> Plan:
    """Lay out a pile between the walls it may lean on."""
    limits = [[x[0], x[-1]], [y[0], y[-1]]]
    fades = [np.ones_like(x), np.ones_like(y)]
    for wall in walls:
        axis = 0 if wall.start_m[0] == wall.end_m[0] else 1
        nodes = (x, y)[axis]
        back = 1 if wall.start_m[axis] > pile.center_m[axis] else -1
        face = wall.start_m[axis] - back * wall.thickness_m / 2
        limits[axis][back == 1] = (min if back == 1 else max)(limits[axis][back == 1], face)
        fades[axis] = fades[axis] * np.clip(1 - back * (nodes - face) / wall.thickness_m, 0, 1)
    weights = [_weights(n, low, high) for n, (low, high) in zip((x, y), limits, strict=True)]
    return Plan(x, y, weights[0], weights[1], fades[0], fades[1])


def _weights(nodes: Array, low: float, high: float) -> Array:
    """Integrals of the nodes' hat functions over [low, high]."""
    spacing = nodes[1] - nodes[0]
    a, b = (np.clip((end - nodes[:-1]) / spacing, 0, 1) for end in (low, high))
    right = np.maximum(b**2 - a**2, 0) / 2
    left = np.maximum(b - a, 0) - right
    weights = np.zeros_like(nodes)
    weights[:-1] += left
    weights[1:] += right
    return np.asarray(weights * spacing)


@dataclass(frozen=True)
class Shape:
    """A heap in units of the radius of the cone of the same volume: ridges with lobed flanks."""

    middle: Array
    along: Array
    ridge: float
    height: Array
    lobe_size: Array
    lobe_phase: Array

    def rise(self, x: Array, y: Array) -> Array:
        """Height over slope: 1 at the highest tip, 0 at the toe, below 0 outside."""
        peaks = zip(
            self.height, self.middle, self.along, self.lobe_size, self.lobe_phase, strict=True
        )
        cones = [h - self._distance(x - m[0], y - m[1], *flank) for h, m, *flank in peaks]
        return np.asarray(np.maximum.reduce(cones), dtype=np.float64)

    def _distance(self, dx: Array, dy: Array, along: Array, size: Array, phase: Array) -> Array:
        """Distance to one ridge; stretched flanks are only ever gentler, never steeper."""
        on_ridge = np.clip(dx * along[0] + dy * along[1], -self.ridge, self.ridge)
        dx, dy = dx - on_ridge * along[0], dy - on_ridge * along[1]
        away = np.hypot(dx, dy)
        turn = (dx + 1j * dy) / np.maximum(away, 1e-12)
        # cos(n angle + phase), n = 1, 2, 3, as real part of a polynomial: no arc tangent needed.
        one, two, three = size * np.exp(1j * phase)
        lobes = (turn * (one + turn * (two + turn * three))).real
        stretch = 1 + size.sum() + lobes
        return np.asarray(np.sqrt((away / stretch) ** 2 + TIP**2) - TIP)


def shape(pile: Pile, rng: np.random.Generator) -> Shape:
    """Draw the peaks of a pile."""
    heading = rng.uniform(0, 180) if pile.heading_deg is None else pile.heading_deg
    turn = math.radians(heading)
    angle = 2 * math.pi * (np.arange(pile.peaks) + rng.uniform(-0.3, 0.3, pile.peaks)) / pile.peaks
    far = pile.spread * rng.uniform(0.7, 1.0, pile.peaks) * (pile.peaks > 1)
    own = np.stack([far * np.cos(angle), 0.6 * far * np.sin(angle)], axis=1)
    turned = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    skew = turn + np.radians(rng.uniform(-15, 15, pile.peaks))
    drawn = Shape(
        middle=own @ turned,
        along=np.stack([np.cos(skew), np.sin(skew)], axis=1),
        ridge=pile.ridge,
        height=np.concatenate([[1.0], rng.uniform(0.75, 1.0, pile.peaks - 1)]),
        lobe_size=rng.uniform(0, LOBES, (pile.peaks, 3)),
        lobe_phase=rng.uniform(0, 2 * math.pi, (pile.peaks, 3)),
    )
    return replace(drawn, middle=drawn.middle - _footprint_middle(drawn))


def _footprint_middle(form: Shape) -> Array:
    """(2,) middle of the box around the footprint."""
    side = np.linspace(-1, 1, 161) * (1.5 + np.abs(form.middle).max() + form.ridge)
    rows, columns = np.nonzero(form.rise(side, side[:, None]) > 0)
    return np.array([side[i].min() + side[i].max() for i in (columns, rows)]) / 2


def radius_of_cone(volume_m3: float, repose_deg: float) -> float:
    """Radius of the cone of a volume at an angle of repose."""
    slope = math.tan(math.radians(repose_deg))
    return float((3 * volume_m3 / (math.pi * slope)) ** (1 / 3))


def volume_of_cone(radius_m: float, repose_deg: float) -> float:
    """Volume of the cone of a radius at an angle of repose."""
    return math.pi / 3 * math.tan(math.radians(repose_deg)) * radius_m**3


def roughness(shape_nodes: tuple[int, int], grain_nodes: float, rng: np.random.Generator) -> Array:
    """Gaussian random field of unit deviation, correlated over `grain_nodes` nodes."""
    white = np.fft.rfft2(rng.standard_normal(shape_nodes))
    fy, fx = np.fft.fftfreq(shape_nodes[0])[:, None], np.fft.rfftfreq(shape_nodes[1])
    # A white field through a Gaussian of width s has correlation length 2 s (to 1 / e).
    blurred = white * np.exp(-2 * (math.pi * grain_nodes / 2) ** 2 * (fx**2 + fy**2))
    field = np.fft.irfft2(blurred, s=shape_nodes)
    return np.asarray(field / field.std())


def heap(where: Plan, pile: Pile, ground_m: Array, rng: np.random.Generator) -> Array:
    """(ny, nx) heights above the floor, at the nodes of `where`, of exactly `volume_m3`.

    The heap is scaled as a whole, which keeps its angles. It is level in itself: on an uneven
    floor its surface does not follow the floor, its thickness does.
    """
    form = shape(pile, rng)
    slope = math.tan(math.radians(pile.repose_deg))
    dx, dy = where.x - pile.center_m[0], (where.y - pile.center_m[1])[:, None]
    middle = np.abs(dy[:, 0]).argmin(), np.abs(dx).argmin()
    below_m = ground_m - ground_m[middle]
    grain_nodes = pile.grain_m / (where.x[1] - where.x[0])
    grain = pile.roughness_m * roughness(ground_m.shape, grain_nodes, rng)
    fade = where.fade_x * where.fade_y[:, None]

    def heights(radius_m: float) -> Array:
        smooth_m = slope * radius_m * form.rise(dx / radius_m, dy / radius_m) - below_m
        # Grains thin out to nothing where less than five deviations lie on the floor.
        cover = np.clip(smooth_m / max(5 * pile.roughness_m, 1e-12), 0, 1)
        return np.asarray(np.maximum(smooth_m + grain * cover, 0) * fade)

    return _scale(where, pile, heights)


def _scale(where: Plan, pile: Pile, heights: Callable[[float], Array]) -> Array:
    """Find the radius at which the volume is the wanted one; the last 1e-6 goes into the height."""
    radius_m = radius_of_cone(pile.volume_m3, pile.repose_deg)
    for _ in range(40):
        height_m = heights(radius_m)
        share = where.volume_m3(height_m) / pile.volume_m3
        if abs(share - 1) < 1e-6:
            return np.asarray(height_m / share)
        radius_m *= min(max(share, 0.1), 10) ** (-1 / 3)
    raise DivespotError(
        f"a pile of {pile.volume_m3} m3 does not fit on the floor; "
        "a larger floor or a smaller pile is needed"
    )
