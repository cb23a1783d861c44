"""Holes in the ground: hills of the surface turned upside down that touch no hill."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.objects import Measured, measuring
from divespot.reasons import NOT_CLEAR, THIN
from divespot.surface import Surface

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.bases import Bases
    from divespot.grid import HeightMap
    from divespot.settings import Settings

#: Reasons for which a hill of the surface turned upside down is not reported as a hole.
NONE = (NOT_CLEAR, THIN)


def with_holes(measured: Measured, grid: HeightMap, bases: Bases, settings: Settings) -> Measured:
    """Add the holes, with negative volumes, to the objects that stand on the ground around them."""
    hills, below = bases.ground.hills, bases.ground.upside_down
    if hills is None or below is None or below.hills is None or below.is_ground is None:
        return measured
    labels = _clear_of(hills, below.hills)
    if not np.any(labels >= 0):
        return measured
    nowhere = Surface.of_all(np.empty((0, 3)))
    own = dataclasses.replace(bases, ground=below, compared={})
    found, _ = _native.measure_objects(
        -grid.heights_m,
        grid.origin_m,
        grid.cell_m,
        (labels, below.is_ground, nowhere.handed_over()),
        measuring(grid, own, settings),
    )
    holes = [item.as_hole() for item in found if item.reason not in NONE]
    return dataclasses.replace(measured, objects=[*measured.objects, *holes])


def _clear_of(hills: NDArray[np.int32], holes: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return the holes without cells in a hill; those are where a pile was dug out."""
    within = np.isin(holes, np.unique(holes[hills >= 0]))
    return np.where(within, np.int32(-1), holes)
