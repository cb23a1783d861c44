"""How reliable a report is, in one sentence."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from divespot.numbers import rounded

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from divespot.report import Pile, Report
    from divespot.results.show_units import Shown

#: From this share of the piles' area on, filled cells are mentioned.
TOLD_SHARE = 0.02


def trust_sentence(report: Report, shown: Shown, texts: Mapping[str, Any]) -> str:
    """Return how certain the total is, the main source of uncertainty, and reservations.

    The grades are the largest uncertainties that the EU permits for solid fuels, by tier
    (Regulation (EU) 601/2012, Annex II).
    """
    total = report.total
    if not report.piles or not total.volume_m3:
        return str(texts["trust_none"])
    percent = 100.0 * total.u95_m3 / abs(total.volume_m3)
    low, high = (shown.per_m3 * (total.volume_m3 + s * total.u95_m3) for s in (-1.0, 1.0))
    u95 = shown.per_m3 * total.u95_m3
    return str(texts["trust_sentence"]).format(
        grade=next(word for most, word in texts["grades"] if most is None or percent <= most),
        low=shown.number(low, u95),
        high=shown.number(high, u95),
        unit=shown.unit,
        percent=rounded(percent, 2),
        term=texts["terms"][_largest_term(report.piles)],
        reservations="".join(_reservations(report, texts)),
    )


def _largest_term(piles: Sequence[Pile]) -> str:
    names = vars(piles[0].budget)
    return max(names, key=lambda name: math.hypot(*(getattr(p.budget, name) for p in piles)))


def _reservations(report: Report, texts: Mapping[str, Any]) -> list[str]:
    found = []
    beyond = [pile.id for pile in report.piles if pile.touches_edge]
    if beyond:
        found.append(texts["reservation_edge"].format(piles=_numbers(beyond, texts)))
    area = sum(pile.footprint_m2 for pile in report.piles)
    unseen = sum((1.0 - pile.seen_fraction) * pile.footprint_m2 for pile in report.piles)
    if area and unseen / area >= TOLD_SHARE:
        percent = rounded(100.0 * unseen / area, 2)
        found.append(texts["reservation_filled"].format(percent=percent))
    if any("does not state its unit" in warning for warning in report.warnings):
        found.append(texts["reservation_unit"])
    return found


def _numbers(ids: Sequence[int], texts: Mapping[str, Any]) -> str:
    one = "pile_one" if len(ids) == 1 else "pile_many"
    return str(texts[one]).format(numbers=", ".join(map(str, ids)))
