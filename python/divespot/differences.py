"""What differs from a surface that was given, without looking for piles."""

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

#: The ground surrounds what stands on it where at least this share of the edge of the seen area is
#: ground.
AROUND = 0.5

#: A warning where nothing says how sure a difference is.
TOO_LITTLE = "too little ground was seen in both scans to tell how small a change shows"


def is_held_against(grid: HeightMap, ground: GroundLevel, settings: Settings) -> bool:
    """Return whether all that differs from the base counts, instead of the piles on the ground.

    So it is against an earlier scan, and above a given height where the ground does not surround
    what stands on it: a filled bin, a pile that was cut out.
    """
    if ground.is_ground is None:
        return False
    if settings.base.startswith("height="):
        edge = _edge(~np.isnan(grid.heights_m))
        return bool(ground.is_ground[edge.ravel()].mean() < AROUND) if edge.any() else True
    return settings.base.startswith("surface=")


def _edge(seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which seen cells lie beside one that was not, or at the end of the map."""
    around = np.pad(seen, 1)
    inner = around[:-2, 1:-1] & around[2:, 1:-1] & around[1:-1, :-2] & around[1:-1, 2:]
    return np.asarray(seen & ~inner)


def measure_differences(
    surface: Surface, grid: HeightMap, earlier: Seen | None, bases: Bases, settings: Settings
) -> Measured:
    """Measure what stands above the base and, from an earlier scan, what lies below it.

    How far the two scans differ where nothing changed says what counts, and how sure it is.
    """
    nothing = np.full(grid.heights_m.size, -1, dtype=np.int32)
    others = measure_objects(surface, grid, nothing, bases, settings)
    loose = surface.points[~surface.is_on]
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
    """Return a warning where nothing says how sure what differs from an earlier scan is."""
    is_told = earlier is None or measured.regions or measured.spread.edges_m
    return [] if is_told else [TOO_LITTLE]
