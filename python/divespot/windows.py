"""Windows: the parts of a survey that are measured one by one, each with what lies around it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from divespot.describe import Described
    from divespot.outline_file import Region

    #: The lowest x and y, and the highest, in the level frame.
    Box: TypeAlias = tuple[float, float, float, float]

#: Edge of a tile in fine voxels, and how much of its surroundings is seen on each side: 64 m and
#: 8 m of voxels of 5 cm. A surface fills some 2.5 million voxels of that, which takes 0.5 GB.
TILE, AROUND = 1280, 160

#: How much is seen on each side of an object for which a window is opened, as a share of its
#: longer side: the ring of ground that its base follows from is half as wide (`Stages.ring_share`).
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
        return self.room_m(box_m) >= SURROUNDINGS * longer_m(box_m)


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
    room_m = AROUND * voxel_m + SURROUNDINGS * longer_m(box_m)
    return Window(grown(box_m, room_m), known, region)


def box_of(places_m: Iterable[Iterable[float]]) -> Box:
    """Return the box around places in plan."""
    plan = np.array([tuple(place)[:2] for place in places_m])
    (x0, y0), (x1, y1) = plan.min(axis=0).tolist(), plan.max(axis=0).tolist()
    return x0, y0, x1, y1


def grown(box_m: Box, by_m: float) -> Box:
    """Return a box that reaches farther on all sides."""
    x0, y0, x1, y1 = box_m
    return x0 - by_m, y0 - by_m, x1 + by_m, y1 + by_m


def joined(boxes_m: Iterable[Box]) -> Box:
    """Return the box around boxes."""
    return box_of(corner for x0, y0, x1, y1 in boxes_m for corner in ((x0, y0), (x1, y1)))


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share a place."""
    along_x = one[0] <= other[2] and other[0] <= one[2]
    return along_x and one[1] <= other[3] and other[1] <= one[3]


def longer_m(box_m: Box) -> float:
    """Return the longer side of a box."""
    return max(box_m[2] - box_m[0], box_m[3] - box_m[1])
