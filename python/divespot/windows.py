"""Windows: the parts of a survey that are measured one by one, each with what lies around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot.boxes import grown, longer

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.boxes import Box
    from divespot.describe import Described
    from divespot.outline_file import Region

#: Edge of a tile in fine voxels, and how much of its surroundings is seen on each side: 64 m and
#: 8 m of voxels of 5 cm. A surface fills some 2.5 million voxels of that, which takes 0.5 GB.
TILE, AROUND = 1280, 160

#: How much is seen on each side of an object for which a window is opened, as a share of its
#: longer side: the annulus of ground that its base follows from is half as wide
#: (`Stages.annulus_share`).
SURROUNDINGS = 0.3


@dataclass(frozen=True, eq=False)
class Window:
    """A rectangle of the level frame that is measured as a scan of its own.

    Attributes
    ----------
    box_m
        The rectangle.
    known
        What was found in the whole survey, and is too large for any tile.
    region
        The outline that is measured inside.

    """

    box_m: Box
    known: Described | None = None
    region: Region | None = None

    def room_m(self, box_m: Box) -> float:
        """Return how far a box lies inside; below 0 where it reaches out."""
        low, high = np.subtract(box_m, self.box_m)[:2], np.subtract(self.box_m, box_m)[2:]
        return float(min(low.min(), high.min()))

    def holds(self, box_m: Box) -> bool:
        """Return whether a box lies inside with its surroundings."""
        return self.room_m(box_m) >= SURROUNDINGS * longer(box_m)


def tiles(places_m: NDArray[np.float64], voxel_m: float) -> list[Window]:
    """Return windows that overlap and together hold all places, shape ``(n, 2 or 3)``."""
    edge_m = TILE * voxel_m
    at = np.unique(np.floor(places_m[:, :2] / edge_m), axis=0)
    boxes = np.hstack([at, at + 1.0]) * edge_m
    return [Window(grown((x0, y0, x1, y1), AROUND * voxel_m)) for x0, y0, x1, y1 in boxes.tolist()]


def around(
    box_m: Box, voxel_m: float, known: Described | None = None, region: Region | None = None
) -> Window:
    """Return a window that holds a box with its surroundings."""
    room_m = AROUND * voxel_m + SURROUNDINGS * longer(box_m)
    return Window(grown(box_m, room_m), known, region)
