"""Returns from no surface: in front of it, behind it, and below the floor."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot.simulate.checks import require, require_not_negative, require_positive, require_share
from divespot.simulate.solids import XYZ, Ball

if TYPE_CHECKING:
    from divespot.simulate.surface import Surface

Array = NDArray[np.float64]

LATE = (0.02, 0.3)
"""Additional distance of a multipath return, as a share of its range."""
CLUMP_SHARE = 0.05
"""Standard deviation of a clump of low points, as a share of its depth."""


@dataclass(frozen=True)
class Dust:
    """A ball of dust in the air, and the number of returns per metre of a ray in it."""

    middle_m: XYZ
    radius_m: float
    per_m: float

    def __post_init__(self) -> None:
        require_positive(self, "radius_m", "per_m")


@dataclass(frozen=True)
class Ghosts:
    """Returns that come from no surface.

    Parameters
    ----------
    rain_share
        Share of pixels with a return from a drop in front of the surface.
    dust
        Clouds with returns in front of the surface.
    late_share
        Share of pixels with a multipath return, which lies behind the surface.
    mirror_share
        Mirror images in the wet floor, as a share of the points off the floor.
    low_points, low_clumps, low_m
        Number of points below the floor, number of clumps that they form, and their depth.
    """

    rain_share: float = 0.0
    dust: tuple[Dust, ...] = ()
    late_share: float = 0.0
    mirror_share: float = 0.0
    low_points: int = 0
    low_clumps: int = 1
    low_m: float = 1.0

    def __post_init__(self) -> None:
        require_share(self, "rain_share", "late_share", "mirror_share")
        require_not_negative(self, "low_points")
        require_positive(self, "low_m")
        require(self.low_clumps >= 1, f"Ghosts.low_clumps is {self.low_clumps}: 1 is needed")

    def along(
        self, distance_m: Array, origin: Array, rays: Array, rng: np.random.Generator
    ) -> Array:
        """Distances of the pixels' returns; those of the surface unless changed by a ghost."""
        answered_m = np.where(
            rng.random(distance_m.size) < self.rain_share,
            distance_m * rng.random(distance_m.size),
            distance_m,
        )
        for cloud in self.dust:
            answered_m = np.minimum(answered_m, _in_cloud(cloud, origin, rays, rng))
        late = rng.random(distance_m.size) < self.late_share
        longer = 1 + rng.uniform(*LATE, distance_m.size)
        return np.where(late & (answered_m == distance_m), distance_m * longer, answered_m)

    def below(
        self, raised: Array, floor: Array, surface: Surface, rng: np.random.Generator
    ) -> Array:
        """(n, 3) points below the floor, given the points off the floor and those on it."""
        chosen = raised[rng.random(len(raised)) < self.mirror_share]
        ground_m = np.array([surface.floor_z(x, y) for x, y in chosen[:, :2]])
        mirrored = chosen * [1, 1, -1] + 2 * np.stack([0 * ground_m, 0 * ground_m, ground_m], 1)
        return np.concatenate([mirrored.reshape(-1, 3), self._low(raised, floor, rng)])

    def _low(self, raised: Array, floor: Array, rng: np.random.Generator) -> Array:
        """Clumps below positions of the scan, equally many below objects and below floor."""
        if not self.low_points:
            return np.empty((0, 3))
        sources = [points for points in (raised, floor) if len(points)]
        picked = [sources[i] for i in rng.integers(len(sources), size=self.low_clumps)]
        middles = np.array([points[rng.integers(len(points))] for points in picked])
        middles[:, 2] -= self.low_m
        clump = rng.integers(self.low_clumps, size=self.low_points)
        spread_m = CLUMP_SHARE * self.low_m
        return np.asarray(middles[clump] + rng.normal(0, spread_m, (self.low_points, 3)))


def _in_cloud(cloud: Dust, origin: Array, rays: Array, rng: np.random.Generator) -> Array:
    """Distances of returns from grains of dust; inf if there is none."""
    ball = Ball(cloud.middle_m, cloud.radius_m)
    enter = ball.meet(origin, rays)
    chord = 2 * ((np.array(cloud.middle_m) - origin) @ rays.T - enter)
    travelled = rng.exponential(1 / cloud.per_m, len(rays))
    with np.errstate(invalid="ignore"):
        return np.where(travelled < chord, enter + travelled, math.inf)
