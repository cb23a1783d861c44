"""From a height map to all that stands on its ground, or was dug out of it (paper, Algorithm 3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.holes import with_holes
from divespot.objects import Measured, find_objects, measure_objects

if TYPE_CHECKING:
    from divespot.bases import Bases
    from divespot.grid import HeightMap
    from divespot.progress import Progress
    from divespot.settings import Settings
    from divespot.surface import Surface


def measure_standing(
    surface: Surface, grid: HeightMap, bases: Bases, s: Settings, run: Progress
) -> Measured:
    """Find and measure objects and holes."""
    labels = run("fine filter", find_objects, grid, bases.ground, s, run.warn)
    measured = run("volume", measure_objects, surface, grid, labels, bases, s)
    return run("holes", with_holes, measured, grid, bases, s)
