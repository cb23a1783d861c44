"""The area between walls in which a pile lies, and the weights to integrate over it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot.simulate.things import RoundWall, Wall

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.simulate.scene import Pile

Array = NDArray[np.float64]
Limits = tuple[tuple[float, float], tuple[float, float]]

WITHIN_CELL = 16
"""Sampling positions along each side of a cell that a round face crosses."""


@dataclass(frozen=True)
class Plan:
    """The nodes on which a pile may lie, and the weights to integrate over them.

    `weight_x` and `weight_y` are the integrals of the nodes' hat functions over the open side of
    the straight walls leaned on, so that the sum of weight times height is the exact volume of the
    bilinear surface. For a round wall, `weight` holds a node's integral in both directions. `fade`
    lowers the pile to zero inside the walls.
    """

    x: Array
    y: Array
    weight_x: Array
    weight_y: Array
    fade: Array
    weight: Array | None = None

    def volume_m3(self, height_m: Array) -> float:
        """Exact integral of the bilinear surface, outside the walls."""
        if self.weight is not None:
            return float((self.weight * height_m).sum())
        return float(self.weight_y @ height_m @ self.weight_x)


def plan(x: Array, y: Array, pile: Pile, walls: Sequence[Wall | RoundWall]) -> Plan:
    """Return the plan of a pile between the walls it may lean on."""
    limits = [[float(x[0]), float(x[-1])], [float(y[0]), float(y[-1])]]
    fades = [np.ones_like(x), np.ones_like(y)]
    for wall in walls:
        if isinstance(wall, RoundWall):
            continue
        axis = 0 if wall.start_m[0] == wall.end_m[0] else 1
        nodes = (x, y)[axis]
        back = 1 if wall.start_m[axis] > pile.center_m[axis] else -1
        face = wall.start_m[axis] - back * wall.thickness_m / 2
        limits[axis][back == 1] = (min if back == 1 else max)(limits[axis][back == 1], face)
        fades[axis] = fades[axis] * np.clip(1 - back * (nodes - face) / wall.thickness_m, 0, 1)
    weights = [_weights(n, low, high) for n, (low, high) in zip((x, y), limits, strict=True)]
    fade, weight = fades[0] * fades[1][:, None], None
    if rounded := [wall for wall in walls if isinstance(wall, RoundWall)]:
        for wall in rounded:
            fade = fade * np.clip(1 + _clear_of(wall, x, y[:, None]) / wall.thickness_m, 0, 1)
        weight = _crossed_weights(x, y, limits, rounded)
    return Plan(x, y, weights[0], weights[1], fade, weight)


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


def _clear_of(wall: RoundWall, x: Array, y: Array) -> Array:
    """Distance of positions from a round face, negative behind it; infinite beyond its ends."""
    dx, dy = x - wall.center_m[0], y - wall.center_m[1]
    turned = (np.degrees(np.arctan2(dy, dx)) - wall.from_deg) % 360 <= wall.turn_deg
    return np.where(turned, wall.radius_m - np.hypot(dx, dy), wall.radius_m)


def _crossed_weights(
    x: Array, y: Array, limits: list[list[float]], walls: list[RoundWall]
) -> Array:
    """(ny, nx) integrals of the nodes' hat functions over the area open between all walls."""

    def is_open(x: Array, y: Array) -> NDArray[np.bool_]:
        (x0, x1), (y0, y1) = limits
        inside = (x >= x0) & (x <= x1) & (y >= y0) & (y <= y1)
        for wall in walls:
            inside = inside & (_clear_of(wall, x, y) >= 0)
        return inside

    nodes = is_open(x, y[:, None])
    corners = np.zeros((y.size - 1, x.size - 1), dtype=int)
    for i, j in np.ndindex(2, 2):
        corners += nodes[i : i + y.size - 1, j : j + x.size - 1]
    share = np.zeros((2, 2, *corners.shape))
    share[:, :, corners == 4] = 0.25
    rows, columns = np.nonzero((corners > 0) & (corners < 4))
    spacing = x[1] - x[0]
    steps = (np.arange(WITHIN_CELL) + 0.5) / WITHIN_CELL
    for u in steps:
        for v in steps:
            there = is_open(x[columns] + u * spacing, y[rows] + v * spacing) / WITHIN_CELL**2
            for i, j in np.ndindex(2, 2):
                hat = (u if j else 1 - u) * (v if i else 1 - v)
                share[i, j, rows, columns] += hat * there
    weights = np.zeros((y.size, x.size))
    for i, j in np.ndindex(2, 2):
        weights[i : i + y.size - 1, j : j + x.size - 1] += share[i, j]
    return np.asarray(weights * spacing**2)
