"""Repeated measurements: how much a volume depends on irrelevant details of the scan."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError
from divespot.progress import Progress
from divespot.spacing import survey

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from divespot.doors import Report
    from divespot.intake import Alter, Cloud
    from divespot.report import Pile
    from divespot.settings import Settings

    Measure = Callable[[Cloud, Settings, Progress], Report]

#: A volume that changes by more than this share of its u95 is reported as not stable.
STABLE = 1.0 / 3.0

#: Rounding step, as a share of the points' roughness, far below the information in a coordinate.
ROUNDED = 0.1

#: Share of the points that is left out.
LEFT_OUT = 0.01


def measure_again(measure: Measure, cloud: Cloud, settings: Settings, run: Progress) -> Report:
    """Measure a scan, and again a little otherwise, and tell how much each volume changes."""
    report = measure(cloud.altered(), settings, run)
    changes: dict[int, dict[str, float]] = {pile.id: {} for pile in report.piles}
    for what, alter, chosen in _variants(cloud, settings):
        found = run(what, _piles, measure, cloud.altered(alter), chosen)
        for pile in report.piles:
            changes[pile.id][what] = abs(_volume_m3(pile, found) - pile.volume_m3)
    piles = tuple(replace(p, repeat_m3=max(changes[p.id].values())) for p in report.piles)
    told = run.told(*(text for p in piles for text in _unstable(p, changes[p.id])))
    return replace(report, piles=piles, warnings=(*report.warnings, *told))


def _variants(cloud: Cloud, settings: Settings) -> Iterator[tuple[str, Alter, Settings]]:
    """Yield what is done to a scan that should mean nothing, how, and the settings after it."""
    points = cloud.points
    rng = np.random.default_rng(settings.seed)
    step_m = ROUNDED * survey(points, seed=settings.seed, threads=settings.threads).roughness_m
    yield "another seed", np.copy, settings.changed(seed=settings.seed ^ 1)
    if step_m > 0.0:
        what = f"coordinates rounded to {step_m:.1g} m"
        yield what, lambda points: np.round(points / step_m) * step_m, settings
    fewer = f"{LEFT_OUT:.0%} fewer points"
    yield fewer, lambda points: points[rng.random(len(points)) >= LEFT_OUT], settings
    yield "every point twice", lambda points: np.concatenate([points, points]), settings


def _piles(measure: Measure, cloud: Cloud, settings: Settings) -> tuple[Pile, ...]:
    try:
        return measure(cloud, settings, Progress(None)).piles
    except DivespotError:
        return ()


def _volume_m3(pile: Pile, found: tuple[Pile, ...]) -> float:
    """Return the volume of the pile at the position of the given one; 0 if there is none."""
    if pile.name is not None:
        return sum(other.volume_m3 for other in found if other.name == pile.name)
    near = min(found, key=lambda other: _apart(pile, other), default=None)
    if near is None or _apart(pile, near) > 0.5 * _width(pile):
        return 0.0
    return near.volume_m3


def _apart(one: Pile, other: Pile) -> float:
    return float(np.linalg.norm(np.subtract(one.centroid_m, other.centroid_m)))


def _width(pile: Pile) -> float:
    """Return the longer side of the box around an outline, in the scan's unit."""
    return float(np.ptp(pile.outline_m, axis=0).max())


def _unstable(pile: Pile, changes: dict[str, float]) -> Iterator[str]:
    what, change_m3 = max(changes.items(), key=lambda item: item[1])
    if change_m3 > STABLE * pile.u95_m3:
        yield (
            f"pile {pile.id} is not stable: with {what} its volume changes by {change_m3:.3g} m3, "
            f"{change_m3 / pile.u95_m3:.1f} of its u95"
        )
