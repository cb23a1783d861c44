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

    from divespot.simulate.plan import Plan
    from divespot.simulate.scene import Pile

Array = NDArray[np.float64]

TIP = 0.06
"""Radius to which a tip is rounded, in radii of the cone of the same volume."""
LOBES = 0.07
"""Largest share by which one of three lobes stretches a cone. With (1 + 4 + 9) LOBES below 1 the
stretched flank is nowhere steeper than the cone (Cauchy-Schwarz on its gradient)."""


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
        """Height divided by slope: 1 at the highest tip, 0 at the toe, below 0 outside."""
        peaks = zip(
            self.height, self.middle, self.along, self.lobe_size, self.lobe_phase, strict=True
        )
        cones = [h - self._distance(x - m[0], y - m[1], *flank) for h, m, *flank in peaks]
        return np.asarray(np.maximum.reduce(cones), dtype=np.float64)

    def _distance(self, dx: Array, dy: Array, along: Array, size: Array, phase: Array) -> Array:
        """Distance to one ridge; stretched flanks are never steeper."""
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
    skew = turn + np.radians(rng.uniform(-pile.skew_deg, pile.skew_deg, pile.peaks))
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

    The heap is scaled as a whole, which preserves its angles. On an uneven floor its surface does
    not follow the floor; only its thickness varies.
    """
    form = shape(pile, rng)
    slope = math.tan(math.radians(pile.repose_deg))
    dx, dy = where.x - pile.center_m[0], (where.y - pile.center_m[1])[:, None]
    middle = np.abs(dy[:, 0]).argmin(), np.abs(dx).argmin()
    below_m = ground_m - ground_m[middle]
    grain_nodes = pile.grain_m / (where.x[1] - where.x[0])
    grain = pile.roughness_m * roughness(ground_m.shape, grain_nodes, rng)

    def heights(radius_m: float) -> Array:
        poured_m = slope * radius_m * form.rise(dx / radius_m, dy / radius_m)
        smooth_m = _dug(pile, poured_m, dx / radius_m, dy / radius_m, radius_m) - below_m
        # Roughness fades to zero where the heap is thinner than five deviations.
        cover = np.clip(smooth_m / max(5 * pile.roughness_m, 1e-12), 0, 1)
        return np.asarray(np.maximum(smooth_m + grain * cover, 0) * where.fade)

    return _scale(where, pile, heights)


def _dug(pile: Pile, poured_m: Array, x: Array, y: Array, radius_m: float) -> Array:
    """Heights that a loader leaves of the poured ones, at positions in cone radii."""
    if pile.cut is None:
        return poured_m
    turn = math.radians(pile.cut.heading_deg)
    before = pile.cut.toe - (x * math.cos(turn) + y * math.sin(turn))
    face_m = math.tan(math.radians(pile.cut.face_deg)) * radius_m * before
    return np.asarray(np.minimum(poured_m, face_m))


def _scale(where: Plan, pile: Pile, heights: Callable[[float], Array]) -> Array:
    """Find the radius that gives the volume; the last 1e-6 is corrected by scaling the height."""
    radius_m = radius_of_cone(pile.volume_m3, pile.repose_deg)
    for _ in range(40):
        height_m = heights(radius_m)
        share = where.volume_m3(height_m) / pile.volume_m3
        if abs(share - 1) < 1e-6:
            return np.asarray(height_m / share)
        radius_m *= min(max(share, 0.1), 10) ** (-1 / 3)
    raise DivespotError(
        f"a pile of {pile.volume_m3} m3 does not fit on the floor: "
        "a larger floor or a smaller pile is needed"
    )
