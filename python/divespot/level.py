"""The levelled scene, for pictures and volume methods."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from divespot.detection import NO_SPREAD, Spread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.directions import Position
    from divespot.frame import Frame
    from divespot.gaps import Gaps
    from divespot.grid import HeightMap
    from divespot.reasons import Reason


@dataclass(frozen=True)
class Outline:
    """The outline of an object in the level frame, and the reason; None for a pile."""

    corners_m: tuple[Position, ...]
    reason: Reason | None


@dataclass(frozen=True, eq=False)
class Level:
    """The levelled scene, for pictures.

    Attributes
    ----------
    closed_map
        The surface, with empty bands closed up.
    closed_base_m
        Shape of that map: height of the base below each cell, NaN where it is not known.
    ground_m
        Height of the ground.
    outlines
        Outlines of all objects, in the report's order.
    frame
        Conversion between the level frame and the scan's.
    gaps
        The empty bands that were closed up.
    spread
        Difference from the earlier scan over unchanged ground, if that scan is the base.

    """

    closed_map: HeightMap
    closed_base_m: NDArray[np.float64]
    ground_m: float
    outlines: tuple[Outline, ...]
    frame: Frame
    gaps: Gaps
    spread: Spread = NO_SPREAD

    @cached_property
    def height_map(self) -> HeightMap:
        """The surface."""
        return self.gaps.opened_map(self.closed_map)

    @cached_property
    def base_m(self) -> NDArray[np.float64]:
        """Shape of the map: height of the base below each cell, NaN where it is not known."""
        return self.gaps.opened_cells(self.closed_base_m, self.closed_map, np.nan)
