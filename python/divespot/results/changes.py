"""Gains and losses, from the places where two surveys differ."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot.differences import TOO_LITTLE
from divespot.doors import Comparison
from divespot.reasons import NOT_DETECTED
from divespot.results.comparison import Change, Match, Place, changed, shift_in_scan_m
from divespot.results.pile_matching import both_labels, labels, matched, slopes_between
from divespot.results.telling import counted

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from numpy.typing import NDArray

    from divespot.intake import Source
    from divespot.level import Level
    from divespot.reasons import Reason
    from divespot.report import Pile, Report
    from divespot.results.comparison import Fit

    Surveys: TypeAlias = tuple[Report | None, Report | None]
    Labels: TypeAlias = NDArray[np.int64]

WITHOUT_GROUND = "no ground is in view: only changes were measured, no piles of this scan"


@dataclass(frozen=True, eq=False)
class _Ground:
    """The two surveys, on the cells of the later one."""

    level: Level
    was: Labels
    is_now: Labels
    slopes: tuple[NDArray[np.float64], NDArray[np.float64]]
    fit: Fit

    @classmethod
    def of(cls, reports: Surveys, level: Level, fit: Fit) -> _Ground:
        piles = [() if report is None else report.piles for report in reports]
        was, is_now = both_labels(piles[0], piles[1], level)
        return cls(level, was, is_now, slopes_between(level), fit)

    def place(self, pile: Pile, at: NDArray[np.bool_]) -> _Found:
        """Return a place with its uncertainty, including that of the alignment."""
        cell_m2 = self.level.height_map.cell_m**2
        x, y, _ = self.level.frame.to_level(np.array([pile.centroid_m]))[0].tolist()
        u_alignment = self.fit.alignment.u_m(x, y) * pile.footprint_m2
        rise = float(self.slopes[0][at].sum()) * cell_m2, float(self.slopes[1][at].sum()) * cell_m2
        u = math.hypot(pile.budget.combined_m3(), u_alignment, self._u_beside_m3(rise))
        limit = self.fit.spread.clear_by(pile.footprint_m2) * u
        below: Reason | None = NOT_DETECTED if abs(pile.volume_m3) < limit else None
        return _Found(pile, at, u_alignment, rise, limit, pile.reason or below)

    def _u_beside_m3(self, rise_m2: tuple[float, float]) -> float:
        """Return a volume's standard uncertainty due to the alignment in x and y."""
        return 0.0 if self.fit.sideways is None else self.fit.sideways.u_m3(rise_m2)

    def told(self, found: _Found, number: int) -> Place:
        """Return a place as part of the result."""
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
        """Add up places; without places the uncertainty is not known."""
        if not found:
            return Change(0.0, math.nan)
        rise = sum(one.rise_m2[0] for one in found), sum(one.rise_m2[1] for one in found)
        u_alignment = sum(one.u_alignment_m3 for one in found)
        return changed([one.pile for one in found], u_alignment, self._u_beside_m3(rise))


@dataclass(frozen=True, eq=False)
class _Found:
    """A place where the surveys differ."""

    pile: Pile
    at: NDArray[np.bool_]
    u_alignment_m3: float
    rise_m2: tuple[float, float]
    limit_m3: float
    reason: Reason | None


def comparison_of(
    reports: Surveys,
    sources: tuple[Source, Source],
    difference: Report,
    fit: Fit,
) -> Comparison:
    """Return the comparison of a later scan with the earlier one."""
    ground = _Ground.of(reports, difference.level, fit)
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
    """Return all places that differ: first those that the kernel counts, then the others."""
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
            "are too, and u95 does not include how well they fit"
        )
    elif fit.aligned:
        told.append(_moved(fit, level))
    if fit.alignment.blocks and not fit.spread.edges_m:
        told.append(TOO_LITTLE)
    return tuple(told)


def _moved(fit: Fit, level: Level) -> str:
    """Return a sentence on how the earlier scan was moved."""
    raised = f"the earlier scan was raised by {fit.alignment.offset_m:.2g} m to match the ground"
    shift_m = shift_in_scan_m(fit, level)
    if shift_m is None:
        return raised
    moved = ", ".join(f"{-value:.2g}" for value in shift_m[:2])
    return f"{raised}, and moved by {moved} m in x and y so that unchanged piles coincide"


def _not_counted(others: Sequence[_Found]) -> list[str]:
    """Return a warning about differences that are not counted as gain or loss."""
    if not others:
        return []
    volume_m3 = sum(abs(one.pile.volume_m3) for one in others)
    reasons = ", ".join(dict.fromkeys(str(one.reason) for one in others))
    places = counted(len(others), "place")
    return [f"{places} that differ, {volume_m3:.2g} m³ in all, are not counted: {reasons}"]
