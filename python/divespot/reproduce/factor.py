"""The paper's compensation factor, calibrated on piles of another seed.

It corrects for the toe that is cut off, whose share depends on the size of the piles, so that each
area has its own factor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from divespot.reproduce.scans import PAPER, Scan, Variant
from divespot.simulate.shapes import ROWS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from divespot.evaluate.outcome import PileOutcome
    from divespot.reproduce.found import Found, Need
    from divespot.reproduce.plan import Plan

VARIANT = Variant("paper", PAPER)


#: The shapes used in a quick run: two or three of each area, of all kinds.
FEW = ("shape-01", "shape-05", "shape-09", "shape-11", "shape-15", "shape-16", "shape-18")


def needs(plan: Plan, density: float, area_m2: float | None = None) -> list[Need]:
    """Return scans of other piles, of one area in m2 or of all, with the paper's method."""
    names = [
        name for name in (ROWS if plan.side_rounds > 1 else FEW) if area_m2 in {None, ROWS[name][0]}
    ]
    return [(Scan(name, plan.other_seed, 0, density), VARIANT) for name in names]


def factor(found: Found, plan: Plan, density: float, area_m2: float) -> float:
    """Return the factor of an area that minimizes the sum of squared relative errors."""
    piles = found.piles(needs(plan, density, area_m2))
    shares = [(pile.volume_m3 or 0.0) / pile.truth_m3 for pile in piles]
    squares = sum(share * share for share in shares)
    return sum(shares) / squares if squares > 0.0 else 1.0


def compensated(found: Found, plan: Plan, needed: Iterable[Need]) -> list[PileOutcome]:
    """Return the piles measured by the paper's method, multiplied by the factor of their area.

    A volume is linear in the factor, which therefore need not be known when a scan is measured.
    """
    return [_times(found.measurement(need).pile, _by(found, plan, need[0])) for need in needed]


def _by(found: Found, plan: Plan, scan: Scan) -> float:
    return factor(found, plan, scan.density, ROWS[scan.scene][0])


def _times(pile: PileOutcome, by: float) -> PileOutcome:
    if pile.volume_m3 is None or pile.u95_m3 is None:
        return pile
    return replace(pile, volume_m3=by * pile.volume_m3, u95_m3=by * pile.u95_m3)
