"""The levelled scene that pictures and volume methods look at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.directions import Position
    from divespot.frame import Frame
    from divespot.grid import HeightMap


@dataclass(frozen=True)
class Outline:
    """The outline of an object in the level frame, and why it is no pile; None for a pile."""

    corners_m: tuple[Position, ...]
    reason: str | None


@dataclass(frozen=True, eq=False)
class Level:
    """The levelled scene, for pictures.

    Attributes
    ----------
    height_map
        The surface.
    ground_m
        Height of the ground.
    outlines
        Outlines of all objects, in the report's order.
    base_m
        Shape of the map: the base in force below each cell, NaN where it is not known.
    frame
        The way from here to the scan.

    """

    height_map: HeightMap
    ground_m: float
    outlines: tuple[Outline, ...]
    base_m: NDArray[np.float64]
    frame: Frame
