"""The surface that is scanned: floor and piles as one bilinear height field."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from divespot.simulate.floor import Floor

Array = NDArray[np.float64]


def axes(floor: Floor) -> tuple[Array, Array]:
    """Return the x and y of the nodes, centred at the origin."""
    return _axis(floor.length_m, floor.node_m), _axis(floor.width_m, floor.node_m)


def _axis(side_m: float, node_m: float) -> Array:
    count = math.ceil(side_m / node_m) + 1
    return np.asarray((np.arange(count) - (count - 1) / 2) * node_m, dtype=np.float64)


def floor_heights(floor: Floor, rng: np.random.Generator) -> Array:
    """(ny, nx) heights, at its nodes, of the bare floor that piles are poured on."""
    x, y = axes(floor)
    beyond_m = np.maximum(x - floor.edge_m, 0.0)
    along = x * math.tan(math.radians(floor.slope_deg))
    along += beyond_m * math.tan(math.radians(floor.fold_deg))
    along += floor.step_m * (x >= floor.edge_m)
    lain_on = (level for level in floor.levels if level.under_piles)
    rises = (level.heights(x, y[:, None]) for level in lain_on)
    return sum(rises, along + waver(x, y[:, None], floor, rng))


def levels_beside(floor: Floor) -> Array:
    """(ny, nx) heights added by levels on whose faces no pile lies."""
    x, y = axes(floor)
    total = np.zeros((y.size, x.size))
    for level in floor.levels:
        if not level.under_piles:
            total += level.heights(x, y[:, None])
    return total


def waver(x: Array, y: Array, floor: Floor, rng: np.random.Generator) -> Array:
    """Sum of a few random long waves whose largest deviation from zero is `wave_m`."""
    total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
    if floor.wave_m == 0:
        return total
    for _ in range(4):
        heading, phase = rng.uniform(0, 2 * math.pi, 2)
        number = 2 * math.pi / (floor.wave_length_m * rng.uniform(0.7, 1.4))
        total += np.sin(number * (x * math.cos(heading) + y * math.sin(heading)) + phase)
    total -= (total.max() + total.min()) / 2
    return np.asarray(total * (floor.wave_m / total.max()))


@dataclass(frozen=True, eq=False)
class Surface:
    """Floor and piles, bilinear between nodes.

    Attributes
    ----------
    x, y
        Node positions, evenly spaced.
    ground_m, height_m
        (ny, nx) heights of the floor, and of the piles above the floor.
    owner
        (ny, nx) number of the pile at each node, from 1; 0 where the floor is bare.
    """

    x: Array
    y: Array
    ground_m: Array
    height_m: Array
    owner: NDArray[np.int16]

    @property
    def node_m(self) -> float:
        """Spacing of the nodes."""
        return float(self.x[1] - self.x[0])

    @cached_property
    def _patches(self) -> Array:
        return patches(self.ground_m + self.height_m)

    def _cell(self, x: Array, y: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """Flat index of the cell, and the position in it from 0 to 1; outside, the nearest cell."""
        u = (x - self.x[0]) * (1 / self.node_m)
        v = (y - self.y[0]) * (1 / self.node_m)
        column = np.clip(u.astype(np.intp), 0, self.x.size - 2)
        row = np.clip(v.astype(np.intp), 0, self.y.size - 2)
        return row * (self.x.size - 1) + column, u - column, v - row

    def z(self, x: Array, y: Array) -> Array:
        """Height of the scanned surface at positions in plan."""
        cell, u, v = self._cell(x, y)
        patch = self._patches[cell]
        return np.asarray(
            patch[:, 0] + u * patch[:, 1] + v * (patch[:, 2] + u * patch[:, 3]), dtype=np.float64
        )

    def owner_at(self, x: Array, y: Array) -> NDArray[np.int16]:
        """Pile number of the nearest node, 0 for bare floor."""
        return np.asarray(self.owner[self._nearest(x, y)], dtype=np.int16)

    def floor_z(self, x: float, y: float) -> float:
        """Height of the floor at the node nearest to a place, below any pile on it."""
        return float(self.ground_m[self._nearest(np.array(x), np.array(y))])

    def _nearest(self, x: Array, y: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        column = np.rint((x - self.x[0]) / self.node_m).astype(np.intp)
        row = np.rint((y - self.y[0]) / self.node_m).astype(np.intp)
        return np.clip(row, 0, self.y.size - 1), np.clip(column, 0, self.x.size - 1)

    @cached_property
    def steepest(self) -> float:
        """Upper bound of the slope, rise over run."""
        z = self.ground_m + self.height_m
        rise = [np.abs(np.diff(z, axis=axis)).max() for axis in (0, 1)]
        return float(math.hypot(*rise)) / self.node_m

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest corner of a box around the surface, with a margin of one node."""
        z = self.ground_m + self.height_m
        slack = self.node_m
        low = np.array([self.x[0], self.y[0], z.min() - slack])
        return low, np.array([self.x[-1], self.y[-1], z.max() + slack])


def patches(z: Array) -> Array:
    """(cells, 4) coefficients of 1, u, v, u v in each cell of a grid of nodes."""
    a, b, c, d = z[:-1, :-1], z[:-1, 1:], z[1:, :-1], z[1:, 1:]
    return np.stack([a, b - a, c - a, a - b - c + d], axis=-1).reshape(-1, 4)
