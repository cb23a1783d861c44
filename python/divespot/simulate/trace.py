"""Intersections of rays with the surface and the objects on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from divespot.simulate.surface import Surface

Array = NDArray[np.float64]

NEAR_NODES = 0.5
"""Gap, in node spacings, below which the secant may lengthen a ray's step."""
CLOSE_NODES = 1e-5
"""Gap, in node spacings, that counts as a hit."""
TOGETHER = 8192
"""Number of rays traced together: few enough that a step's arrays stay in the cache."""
MAX_STEPS = 200
"""A ray still above the surface after this many steps grazes it and returns nothing."""


def span(origin: Array, rays: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Distances at which rays enter and leave a box; a box is missed if the first is larger."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - origin) / rays, (high - origin) / rays
    # A ray that lies in a face gives 0 / 0; fmin and fmax then keep the other face's bound.
    enter, leave = np.fmin(a, b), np.fmax(a, b)
    return np.maximum(enter.max(axis=1), 0.0), leave.min(axis=1)


def meet_surface(surface: Surface, origin: Array, rays: Array) -> Array:
    """Distance along each ray to its first intersection with the surface; inf without one.

    A step never exceeds gap / (fastest approach that the steepest slope allows), so that no crest
    is skipped; only within half a node of the surface is the secant used.

    Parameters
    ----------
    surface
        The scanned surface.
    origin
        (3,) start of all rays, above the surface.
    rays
        (n, 3) unit vectors.
    """
    hits = [_meet(surface, origin, rays[i : i + TOGETHER]) for i in range(0, len(rays), TOGETHER)]
    return np.concatenate(hits)


def _meet(surface: Surface, origin: Array, rays: Array) -> Array:
    start, stop = span(origin, rays, *surface.bounds)
    closing = surface.steepest * np.hypot(rays[:, 0], rays[:, 1]) - rays[:, 2]
    (live,) = np.nonzero((start < stop) & (closing > 0))
    hits = np.full(len(rays), np.inf)
    # One row per quantity, so that finished rays are removed with one selection.
    ray = np.vstack([rays[live].T, stop[live], closing[live]])
    t, step, gap_before = start[live], np.zeros(live.size), np.full(live.size, np.inf)
    for _ in range(MAX_STEPS):
        gap = origin[2] + t * ray[2] - surface.z(origin[0] + t * ray[0], origin[1] + t * ray[1])
        met = np.abs(gap) < CLOSE_NODES * surface.node_m
        hits[live[met]] = t[met]
        step = _next_step(gap, gap_before, step, ray[4], NEAR_NODES * surface.node_m)
        t = t + step
        on = ~met & (t < ray[3])
        live, ray, t, step, gap_before = live[on], ray[:, on], t[on], step[on], gap[on]
        if not live.size:
            break
    return hits


def _next_step(gap: Array, gap_before: Array, step: Array, closing: Array, near_m: float) -> Array:
    """Safe step, lengthened up to eightfold by the secant where the surface is near."""
    with np.errstate(divide="ignore", invalid="ignore"):
        secant = closing * step / (gap_before - gap)
    longer = np.where(np.abs(gap) < near_m, np.clip(np.nan_to_num(secant), 1.0, 8.0), 1.0)
    return np.asarray(gap / closing * longer, dtype=np.float64)
