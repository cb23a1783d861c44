"""Differences from a given surface, measured without searching for piles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.judgement import Both
from divespot.objects import Measured, measure_objects, measuring

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.bases import Bases
    from divespot.earlier import Seen
    from divespot.grid import HeightMap
    from divespot.ground_level import GroundLevel
    from divespot.settings import Settings
    from divespot.surface import Surface

#: The ground surrounds the objects on it if at least this share of the edge of the seen area is
#: ground.
AROUND = 0.5

#: Warning if the uncertainty of a difference is unknown.
TOO_LITTLE = "too little ground was seen in both scans to determine the smallest detectable change"


def is_held_against(grid: HeightMap, ground: GroundLevel, settings: Settings) -> bool:
    """Return whether all differences from the base count, instead of the piles on the ground.

    That is so for an earlier scan, and for a given height if the ground does not surround the
    material on it: a filled bin, a pile that was cut out.
    """
    if ground.is_ground is None:
        return False
    if settings.base.startswith("height="):
        edge = _edge(~np.isnan(grid.heights_m))
        return bool(ground.is_ground[edge.ravel()].mean() < AROUND) if edge.any() else True
    return settings.has_earlier


def _edge(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the seen cells beside a cell that was not seen, or at the edge of the map."""
    around = np.pad(seen, 1)
    inner = around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
    return np.asarray(seen & ~inner)


def measure_differences(
    surface: Surface, grid: HeightMap, earlier: Seen | None, bases: Bases, settings: Settings
) -> Measured:
    """Measure volumes above the base and, for an earlier scan, below it.

    The difference of the scans over unchanged ground gives the detection limit and the uncertainty.
    """
    nothing = np.full(grid.heights_m.size, -1, dtype=np.int32)
    loose = surface.points[~surface.is_on]
    others = measure_objects(surface, grid, nothing, bases, settings)
    objects, base_m = _native.measure_difference(
        (grid.heights_m, grid.counts, loose),
        None if earlier is None else (earlier.grid.heights_m, earlier.grid.counts, earlier.loose),
        grid.origin_m,
        grid.cell_m,
        measuring(grid, bases, settings),
    )
    if earlier is None or bases.ground.is_ground is None or bases.chosen is None:
        return Measured([*objects, *others.objects], base_m, compared=())
    earlier_m = bases.chosen.over(grid.heights_m.shape, grid.origin_m, grid.cell_m)
    both = Both(grid, loose, bases.ground.is_ground, earlier, earlier_m)
    places, spread = both.judged(objects)
    return Measured([*places, *others.objects], base_m, compared=(), spread=spread)


def unsure(measured: Measured, earlier: Seen | None) -> list[str]:
    """Return a warning if the uncertainty of differences from an earlier scan is unknown."""
    is_told = earlier is None or measured.regions or measured.spread.edges_m
    return [] if is_told else [TOO_LITTLE]
