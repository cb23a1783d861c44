"""Statistics of errors."""

from __future__ import annotations

import statistics
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from divespot.evaluate.outcome import Outcome, PileOutcome


NONE = "no object of its own"


@dataclass(frozen=True)
class ErrorStatistics:
    """Errors of measured volumes; None where there are no data.

    Attributes
    ----------
    count
        Number of true volumes.
    mean_error, largest_error
        Mean and largest absolute relative error.
    bias
        Mean relative error, with its sign.
    coverage
        Share of the volumes whose truth lies within the expanded uncertainty.
    median_u95
        Median expanded uncertainty of the piles that were found, as a share of the true volume.
    stable
        Of the piles that were also measured in slightly changed scans, the share that changed by
        at most a third of their expanded uncertainty.

    """

    count: int
    mean_error: float | None
    largest_error: float | None
    bias: float | None
    coverage: float | None
    median_u95: float | None
    stable: float | None = None

    @classmethod
    def of(cls, volumes: Iterable[PileOutcome]) -> ErrorStatistics:
        """Take the statistics of some volumes."""
        known = list(volumes)
        if not known:
            return cls(0, None, None, None, None, None)
        errors = [one.error for one in known]
        stable = [one.stable for one in known if one.stable is not None]
        u95 = [one.u95_m3 / one.truth_m3 for one in known if one.u95_m3 is not None]
        return cls(
            count=len(known),
            mean_error=statistics.fmean(map(abs, errors)),
            largest_error=max(map(abs, errors)),
            bias=statistics.fmean(errors),
            coverage=statistics.fmean(one.covered for one in known),
            median_u95=statistics.median(u95) if u95 else None,
            stable=statistics.fmean(stable) if stable else None,
        )


@dataclass(frozen=True)
class Summary:
    """The results of some scans of a kind.

    Attributes
    ----------
    scans, right
        Number of scans, and of those where every pile was found and there was no false pile.
    piles, total
        Statistics of single piles, and of all piles of a scan together.
    extras
        What the false piles are, with counts.
    missed
        Reasons why piles were not recognized, with counts; `NONE` if nothing was found there.
    failures
        Reasons why scans were not measured, with counts.

    """

    scans: int
    right: int
    piles: ErrorStatistics
    total: ErrorStatistics
    extras: Mapping[str, int]
    missed: Mapping[str, int]
    failures: Mapping[str, int]

    @classmethod
    def of(cls, outcomes: Sequence[Outcome]) -> Summary:
        """Summarize outcomes."""
        piles = [pile for one in outcomes for pile in one.piles]
        return cls(
            scans=len(outcomes),
            right=sum(one.right for one in outcomes),
            piles=ErrorStatistics.of(piles),
            total=ErrorStatistics.of(one.total for one in outcomes if one.total is not None),
            extras=_counted(extra.what for one in outcomes for extra in one.extras),
            missed=_counted(pile.instead or NONE for pile in piles if pile.volume_m3 is None),
            failures=_counted(one.failure for one in outcomes if one.failure is not None),
        )


def _counted(names: Iterable[str]) -> dict[str, int]:
    return dict(Counter(names))
