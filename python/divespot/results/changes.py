"""From what differs between two surveys to what was gained and lost."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from divespot.doors import Comparison
from divespot.results.comparison import Change, Match, Place, changed, shift_in_scan_m
from divespot.results.pile_matching import both_labels, labels, matched
from divespot.results.place_maps import inner, slopes_of, things, tops_m
from divespot.results.telling import counted

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    from divespot.intake import Source
    from divespot.level import Level
    from divespot.report import Pile, Report
    from divespot.results.comparison import Fit

    Surveys: TypeAlias = tuple[Report | None, Report | None]
    Points: TypeAlias = NDArray[np.float64]
    Labels: TypeAlias = NDArray[np.int64]

WITHOUT_GROUND = "no ground is in view: only what changed was measured, no pile of this scan"

#: Why a place is not counted that may be nothing.
NOT_DETECTED = "below the level of detection"

#: Why a place is not counted where something stands in both surveys, over which the surface of one
#: of them ran.
IN_BOTH = "stands in both surveys"

#: Why a place is not counted of which all that differs lies where a scan ends.
AT_EDGE = "at the edge of what was seen"

#: From this share of its area, or of its height, on, what differs is what stood there before.
MOSTLY = 0.5


@dataclass(frozen=True, eq=False)
class _Ground:
    """What both surveys show, on the cells of the later one."""

    level: Level
    was: Labels
    is_now: Labels
    things: NDArray[np.bool_]
    tops_m: tuple[NDArray[np.float64], NDArray[np.float64]]
    slopes: tuple[NDArray[np.float64], NDArray[np.float64]]
    inner_m: NDArray[np.float64]
    fit: Fit

    @classmethod
    def of(
        cls,
        reports: Surveys,
        points: tuple[Points, Points],
        level: Level,
        fit: Fit,
    ) -> _Ground:
        piles = [() if report is None else report.piles for report in reports]
        was, is_now = both_labels(piles[0], piles[1], level)
        off_m = level.height_map.heights_m - level.base_m
        inner_m = np.where(inner(off_m, level.height_map), off_m, 0.0)
        tops = tops_m(points[0], level), tops_m(points[1], level)
        standing = things(reports, level)
        return cls(level, was, is_now, standing, tops, slopes_of(level), inner_m, fit)

    def place(self, pile: Pile, at: NDArray[np.bool_]) -> _Found:
        """Return what is known of a place, how sure it is, and why it is not counted."""
        cell_m2 = self.level.height_map.cell_m**2
        x, y, _ = self.level.frame.to_level(np.array([pile.centroid_m]))[0].tolist()
        u_alignment = self.fit.alignment.u_m(x, y) * pile.footprint_m2
        rise = float(self.slopes[0][at].sum()) * cell_m2, float(self.slopes[1][at].sum()) * cell_m2
        u_spread = self.fit.spread.u_m3(pile.footprint_m2, math.hypot(*rise))
        u = math.hypot(pile.budget.combined_m3(), u_alignment, u_spread, self._u_beside_m3(rise))
        limit = self.fit.spread.clear_by(pile.footprint_m2) * u
        found = _Found(pile, at, u_alignment, rise, u_spread, limit)
        return replace(found, reason=pile.reason or self._reason(found))

    def _u_beside_m3(self, rise_m2: tuple[float, float]) -> float:
        """Return what the uncertainty of x and y leaves to a volume."""
        return 0.0 if self.fit.sideways is None else self.fit.sideways.u_m3(rise_m2)

    def _reason(self, found: _Found) -> str | None:
        """Return why a place is not counted."""
        if self._stood(found):
            return IN_BOTH
        if abs(found.pile.volume_m3) < found.limit_m3:
            return NOT_DETECTED
        inner_m3 = abs(float(self.inner_m[found.at].sum())) * self.level.height_map.cell_m**2
        return AT_EDGE if inner_m3 < found.limit_m3 else None

    def _stood(self, found: _Found) -> bool:
        """Return whether the survey whose surface is lower has points up there too."""
        at = found.at
        if not at.any() or self.things[at].mean() < MOSTLY:
            return False
        surfaces = self.level.base_m[at], self.level.height_map.heights_m[at]
        is_gain = found.pile.volume_m3 > 0.0
        lower, upper = surfaces if is_gain else surfaces[::-1]
        tops = self.tops_m[0 if is_gain else 1][at]
        known = ~np.isnan(lower + upper + tops)
        reaches = tops > lower + MOSTLY * (upper - lower)
        return bool(known.any() and reaches[known].mean() > MOSTLY)

    def told(self, found: _Found, number: int) -> Place:
        """Return a place as users have it."""
        pile = found.pile
        return Place(
            id=number,
            gain_m3=pile.cut_m3,
            loss_m3=pile.fill_m3,
            net=self.summed([found]),
            detection_m3=found.limit_m3,
            area_m2=pile.footprint_m2,
            max_height_m=pile.max_height_m,
            centroid_m=pile.centroid_m,
            outline_m=pile.outline_m,
            touches_edge=pile.touches_edge,
            piles=_over(self.is_now, found.at),
            piles_before=_over(self.was, found.at),
            reason=found.reason,
        )

    def summed(self, found: Sequence[_Found]) -> Change:
        """Add up places; how sure it is that there are none, nothing says.

        Errors of the ground go together as far as they do in a place as large as all of them.
        """
        if not found:
            return Change(0.0, math.nan)
        area_m2 = sum(one.pile.footprint_m2 for one in found)
        rise = sum(one.rise_m2[0] for one in found), sum(one.rise_m2[1] for one in found)
        together = self.fit.spread.u_m3(area_m2, math.hypot(*rise))
        u_spread = max(together, math.hypot(*(one.u_spread_m3 for one in found)))
        piles = [one.pile for one in found]
        u_alignment = sum(one.u_alignment_m3 for one in found)
        return changed(piles, u_alignment, math.hypot(u_spread, self._u_beside_m3(rise)))


@dataclass(frozen=True, eq=False)
class _Found:
    """A place where the surveys differ."""

    pile: Pile
    at: NDArray[np.bool_]
    u_alignment_m3: float
    rise_m2: tuple[float, float]
    u_spread_m3: float
    limit_m3: float
    reason: str | None = None


def comparison_of(
    reports: Surveys,
    sources: tuple[Source, Source],
    points: tuple[Points, Points],
    difference: Report,
    fit: Fit,
) -> Comparison:
    """Return what came of a later scan that was held against the earlier one.

    `points` are those of both surveys as they were read, in the later one's frame and unit.
    """
    ground = _Ground.of(reports, points, difference.level, fit)
    found = _places(difference, ground)
    listed = [one for one in found if one.reason is None]
    others = [one for one in found if one.reason is not None]
    before, after = (() if report is None else report.piles for report in reports)
    groups = matched(ground.was, ground.is_now, (len(before), len(after)))
    return Comparison(
        before=reports[0],
        after=reports[1],
        sources=sources,
        settings=difference.settings,
        places=tuple(ground.told(one, number) for number, one in enumerate(listed, start=1)),
        not_counted=tuple(ground.told(one, number) for number, one in enumerate(others, start=1)),
        piles=tuple(_match(group, before, after) for group in groups),
        gain=ground.summed([one for one in listed if one.pile.volume_m3 > 0.0]),
        loss=ground.summed([one for one in listed if one.pile.volume_m3 <= 0.0]),
        net=ground.summed(listed),
        fit=fit,
        warnings=(*_warnings(reports, fit, difference.level), *_not_counted(others)),
        scene=difference.level,
    )


def _places(difference: Report, ground: _Ground) -> list[_Found]:
    """Return all places that differ: those that the kernel counts, then those that it does not."""
    found = []
    for piles in (difference.piles, difference.other_objects):
        at = labels(piles, difference.level.frame, difference.level)
        found += [ground.place(pile, at == pile.id) for pile in piles]
    return found


def _over(numbers: Labels, place: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(np.unique(numbers[place & (numbers > 0)]).tolist())


def _match(
    group: tuple[tuple[int, ...], tuple[int, ...]],
    before: Sequence[Pile],
    after: Sequence[Pile],
) -> Match:
    were = [before[i - 1] for i in group[0]]
    are = [after[i - 1] for i in group[1]]
    volumes = [sum(pile.volume_m3 for pile in piles) for piles in (were, are)]
    u95 = math.hypot(*(pile.u95_m3 for pile in (*were, *are)))
    return Match(*group, volumes[0], volumes[1], Change(volumes[1] - volumes[0], u95))


def _warnings(reports: Surveys, fit: Fit, level: Level) -> tuple[str, ...]:
    told = []
    for name, report in zip(("before", "after"), reports, strict=True):
        own = (WITHOUT_GROUND,) if report is None else report.warnings
        told += [f"{name}: {text}" for text in own]
    if fit.sideways is None:
        told.append(
            "no pile stayed the same, so x and y were taken as they are: both scans must be in one "
            "frame"
        )
    if not fit.alignment.blocks:
        told.append(
            "too little ground was seen in both scans to align them: heights were taken as they "
            "are too, and u95 knows nothing of how well they fit"
        )
    elif fit.aligned:
        told.append(_moved(fit, level))
    if fit.alignment.blocks and not fit.spread.edges_m:
        told.append("too little ground was seen in both scans to tell how small a change shows")
    return tuple(told)


def _moved(fit: Fit, level: Level) -> str:
    """Return how the earlier scan was moved."""
    raised = f"the earlier scan was raised by {fit.alignment.offset_m:.2g} m to lie on the ground"
    shift_m = shift_in_scan_m(fit, level)
    if shift_m is None:
        return raised
    moved = ", ".join(f"{-value:.2g}" for value in shift_m[:2])
    return f"{raised}, and moved by {moved} m in x and y so that piles lie on themselves"


def _not_counted(others: Sequence[_Found]) -> list[str]:
    """Return a warning of what differs but is no bulk material that came or went."""
    if not others:
        return []
    volume_m3 = sum(abs(one.pile.volume_m3) for one in others)
    reasons = ", ".join(dict.fromkeys(str(one.reason) for one in others))
    places = counted(len(others), "place")
    return [f"{places} that differ, {volume_m3:.2g} m³ in all, are not counted: {reasons}"]
