"""Which places where two surveys differ are counted, and their uncertainties."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.detection import NO_SPREAD, Spread
from divespot.place_maps import inner, numbered, slopes_of, tops_m
from divespot.reasons import AT_EDGE, IN_BOTH, NOT_DETECTED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from divespot._native import RawObject
    from divespot.earlier import Seen
    from divespot.grid import HeightMap
    from divespot.reasons import Reason

#: From this share of its area, or of its height, a difference is taken for a thing in both surveys.
MOSTLY = 0.5

#: If less than this share of the ground is outside all places, all of it may have changed: a bin
#: filled from wall to wall.
LEAST = 0.1


@dataclass(frozen=True, eq=False)
class Both:
    """Two surveys, on the cells of the later one.

    Attributes
    ----------
    grid
        Heights of the later survey.
    loose
        Points of the later survey off its surface.
    is_ground
        Whether a cell is ground in the later survey.
    earlier
        The earlier survey.
    earlier_m
        Heights of the earlier survey, gaps filled.

    """

    grid: HeightMap
    loose: NDArray[np.float64]
    is_ground: NDArray[np.bool_]
    earlier: Seen
    earlier_m: NDArray[np.float64]

    def judged(self, found: Sequence[RawObject]) -> tuple[list[RawObject], Spread]:
        """Return places with uncertainty and reason, and the spread of unchanged ground."""
        known = [(i, raw) for i, raw in enumerate(found, start=1) if raw.outline_m]
        labels = numbered([(i, np.array(raw.outline_m)[:, :2]) for i, raw in known], self.grid)
        places = self._places(found, labels)
        spread = self._spread(places, labels)
        return [place.judged(spread) for place in places], spread

    @property
    def off_m(self) -> NDArray[np.float64]:
        """The later height less the earlier one."""
        return self.grid.heights_m - self.earlier_m

    def _places(self, found: Sequence[RawObject], labels: NDArray[np.int64]) -> list[_Place]:
        def added_up(values: NDArray[Any]) -> NDArray[np.float64]:
            sums = np.bincount(labels.ravel(), values.ravel(), len(found) + 1)
            return np.asarray(sums[1:] * self.grid.cell_m**2)

        slopes = slopes_of(self.grid.heights_m, self.earlier_m, self.grid.cell_m)
        rises_m2 = np.sqrt(sum(added_up(slope) ** 2 for slope in slopes)).tolist()
        inner_m = np.nan_to_num(np.where(inner(self.off_m, self.grid), self.off_m, 0.0))
        inner_m3 = np.abs(added_up(inner_m)).tolist()
        is_gain = np.array([False, *(raw.cut_m3 > raw.fill_m3 for raw in found)])[labels]
        known, reaches = self._reaches(is_gain)
        stood = added_up(known & reaches) > MOSTLY * added_up(known)
        places = zip(
            range(1, len(found) + 1), found, rises_m2, inner_m3, stood.tolist(), strict=True
        )
        return [_Place(*place) for place in places]

    def _reaches(self, is_gain: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return where the survey with the lower surface has points, and where at the upper one."""
        lower = np.where(is_gain, self.earlier_m, self.grid.heights_m)
        upper = np.where(is_gain, self.grid.heights_m, self.earlier_m)
        tops = tops_m(self.earlier.grid, self.earlier.loose), tops_m(self.grid, self.loose)
        top = np.where(is_gain, *tops)
        return ~np.isnan(lower + upper + top), top > lower + MOSTLY * (upper - lower)

    def _spread(self, places: Sequence[_Place], labels: NDArray[np.int64]) -> Spread:
        """Return how far the surveys differ on ground in both that did not change.

        Ground is taken as changed in places above the detection limit given by all other ground;
        places below the limit count as other ground, which is repeated until nothing changes.
        """
        cell_m, off_m = self.grid.cell_m, self.off_m
        seen = ~np.isnan(off_m)
        still = (self.is_ground & self.earlier.is_ground).reshape(off_m.shape) & seen
        changed = list(places)
        while True:
            rest = still & ~np.isin(labels, [place.number for place in changed])
            if rest.sum() < LEAST * still.sum():
                return NO_SPREAD
            spread = Spread.of(np.where(rest, off_m, np.nan), cell_m, float(seen.sum()) * cell_m**2)
            clear = [place for place in changed if place.is_clear(spread)]
            if len(clear) == len(changed):
                return spread
            changed = clear


@dataclass(frozen=True, eq=False)
class _Place:
    """A place where the surveys differ.

    Attributes
    ----------
    number
        Label of the place.
    rise_m2
        Length of the surface's gradient integrated over it.
    inner_m3
        Volume of it away from the end of a scan.
    stood
        Whether both surveys show the same thing there.

    """

    number: int
    raw: RawObject
    rise_m2: float
    inner_m3: float
    stood: bool

    def judged(self, spread: Spread) -> RawObject:
        """Return the place with its uncertainty, and the reason if it is not counted."""
        sure = self._sure(spread)
        return sure.judged(sure.budget["registration_m3"], self.raw.reason or self._reason(spread))

    def is_clear(self, spread: Spread) -> bool:
        """Return whether the volume is above the detection limit."""
        return abs(self.raw.cut_m3 - self.raw.fill_m3) >= self._limit_m3(spread)

    def _reason(self, spread: Spread) -> Reason | None:
        if self.stood:
            return IN_BOTH
        if not self.is_clear(spread):
            return NOT_DETECTED
        return AT_EDGE if self.inner_m3 < self._limit_m3(spread) else None

    def _limit_m3(self, spread: Spread) -> float:
        return spread.clear_by(self.raw.footprint_m2) * self._sure(spread).combined_m3()

    def _sure(self, spread: Spread) -> RawObject:
        """Return the place with at least the uncertainty of unchanged ground of its size.

        The distance of the ground around it from the other surface (`base_m3`) is due to the same
        errors, and is subtracted.
        """
        u_spread_m3 = spread.u_m3(self.raw.footprint_m2, self.rise_m2)
        beyond_m3 = math.sqrt(max(u_spread_m3**2 - self.raw.budget["base_m3"] ** 2, 0.0))
        return self.raw.judged(max(self.raw.budget["registration_m3"], beyond_m3), self.raw.reason)
