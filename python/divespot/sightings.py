"""Objects as windows show them: every one of them once, though several windows show it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.boxes import box_of, overlap

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from divespot.boxes import Box
    from divespot.describe import Described
    from divespot.frame import Frame
    from divespot.windows import Window

#: An object that ends within so many cells of a window's edge goes on beyond.
CUT_CELLS = 3.0

#: A pile and an object of another kind are the same if neither covers more than so many times the
#: area of the other: a person on a pile is not.
SAME = 2.0


@dataclass(frozen=True, eq=False)
class Sighting:
    """An object as a window shows it; `at_m` is its middle in the level frame."""

    found: Described
    window: Window
    at_m: tuple[float, ...]
    cell_m: float

    @classmethod
    def of(cls, found: Described, window: Window, frame: Frame, cell_m: float) -> Sighting:
        """Return what a window shows."""
        at_m = frame.to_level(np.array([found.pile.centroid_m]))[0].tolist()
        return cls(found, window, tuple(at_m), cell_m)

    @cached_property
    def box_m(self) -> Box:
        """The box around it."""
        return box_of(self.found.outline.corners_m or [self.at_m])

    @property
    def is_cut(self) -> bool:
        """Whether it runs out of the window."""
        return self.window.room_m(self.box_m) < CUT_CELLS * self.cell_m

    @property
    def rank(self) -> tuple[bool, float]:
        """What is least where a sighting counts: before all that which its window was opened for.

        Then that which lies deepest in its window.
        """
        known = self.window.known
        is_meant = known is not None and overlap(self.box_m, box_of(known.outline.corners_m))
        return not is_meant, -self.window.room_m(self.box_m)

    def shows(self, other: Sighting) -> bool:
        """Return whether this is the object, or a part of it, that another window shows."""
        if self.window is other.window or not overlap(self.box_m, other.box_m):
            return False
        if not (self._covers(other) or other._covers(self)):
            return False
        one, two = self.found.pile, other.found.pile
        small, large = sorted((one.footprint_m2, two.footprint_m2))
        return (one.reason is None) == (two.reason is None) or large <= SAME * small

    def _covers(self, other: Sighting) -> bool:
        """Return whether the middle of another lies inside its outline."""
        if not self.found.outline.corners_m:
            return False
        line = np.array(self.found.outline.corners_m)[:, :2]
        return bool(_native.inside([line], np.array([other.at_m[:2]]))[0])


def every_one_once(sightings: Iterable[Sighting]) -> list[Sighting]:
    """Return one sighting of each object."""
    kept: list[Sighting] = []
    for one in sorted(sightings, key=lambda one: one.rank):
        if not is_among(one, kept):
            kept.append(one)
    return kept


def is_among(one: Sighting, kept: Sequence[Sighting]) -> bool:
    """Return whether an object is shown by one of some sightings."""
    return any(other.shows(one) for other in kept)
