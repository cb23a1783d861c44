"""The goals of the measurement, and the figures reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from divespot._arguments import require_kind
from divespot.evaluate.evaluation import BODIES, SHAPES, THINNED_AREA_M2, Evaluation, has_points
from divespot.evaluate.statistics import ErrorStatistics, Summary
from divespot.simulate.families import OF_KIND

if TYPE_CHECKING:
    from collections.abc import Iterator

    from divespot.evaluate.outcome import Outcome

Verdict = Literal["reached", "on average", "missed", "too few"]


@dataclass(frozen=True)
class Compression:
    """A row of the paper's compression table, and the goal for it."""

    voxel_m: float
    paper_kept: float
    paper_error: float
    goal: float


COMPRESSION = (
    Compression(0.01, 0.3104, 0.0168, 0.003),
    Compression(0.02, 0.0822, 0.0255, 0.003),
    Compression(0.05, 0.0145, 0.0317, 0.005),
    Compression(0.1, 0.0038, 0.0572, 0.01),
    Compression(0.2, 0.0011, 0.0854, 0.025),
    Compression(0.3, 0.0005, 0.2945, 0.06),
)
SHAPES_MEAN, SHAPES_LARGEST, SHAPES_U95 = 0.002, 0.006, 0.015
BODIES_MEAN, BODIES_LARGEST = 0.0025, 0.008
EACH_PILE = {
    "three-piles": 0.01,
    "touching-piles": 0.04,
    "big-wall": 0.01,
    "optical-frame": 0.01,
    "utm-yard": 0.01,
    "strays": 0.02,
    "wavering-floor": 0.02,
    "folded-floor": 0.02,
    "stepped-floor": 0.02,
    "bay": 0.03,
    "one-side": 0.1,
    **dict.fromkeys(OF_KIND["over"], 0.01),
    **dict.fromkeys(("over-bars", "over-bucket", "over-walking"), 0.02),
    **dict.fromkeys(("walls-corner", "walls-bay", "walls-boards", "walls-wedge"), 0.01),
    "scan-tripod": 0.01,
    **dict.fromkeys(OF_KIND["vessel"], 0.01),
}
"""Largest error of a pile, by kind of scene."""
TOUCHING, TOUCHING_TOTAL = "touching-piles", 0.01
ONE_SIDE = "one-side"
NO_PILE = ("bare-floor", "sharp-box", "levels-pit-alone")
"""Kinds of scenes without a pile to find."""
COVERAGE, COVERAGE_SCANS = (0.93, 0.97), 300
KIND_COVERAGE, KIND_PILES = (0.89, 0.99), 120
"""Goal for the share of a kind's piles with the truth within u95, and the fewest piles to judge."""
REAL = 0.08
"""Largest error on real scans, whose reference volumes are no more certain than that."""


@dataclass(frozen=True)
class Goal:
    """A goal, in percent as text, and the figure reached, as a share.

    `verdict` is "on average" if a mean reaches what every single value should, and "too few"
    if there were not enough scans to judge.
    """

    what: str
    wanted: str
    value: float
    verdict: Verdict


def goals(evaluation: Evaluation) -> list[Goal]:
    """Return the goals for everything that was evaluated."""
    require_kind("evaluation", evaluation, Evaluation)
    return [
        *_shapes(evaluation.of_kind(SHAPES)),
        *_bodies(evaluation.of_kind(BODIES)),
        *_compression(evaluation),
        *_each_pile(evaluation),
        *_no_pile(evaluation),
        *_coverage(evaluation.whole),
        *_coverage_by_kind(evaluation),
        *_stable(evaluation),
        *_no_worse(evaluation),
        *_real(evaluation.real),
    ]


def _at_most(what: str, value: float | None, limit: float) -> Iterator[Goal]:
    if value is not None:
        reached: Verdict = "reached" if value <= limit else "missed"
        yield Goal(what, f"≤ {100 * limit:.3g}", value, reached)


def _shapes(shapes: list[Outcome]) -> Iterator[Goal]:
    piles = Summary.of(shapes).piles
    yield from _at_most(f"{SHAPES}: mean error", piles.mean_error, SHAPES_MEAN)
    yield from _at_most(f"{SHAPES}: largest error", piles.largest_error, SHAPES_LARGEST)
    yield from _at_most(f"{SHAPES}: median u95", piles.median_u95, SHAPES_U95)


def _bodies(bodies: list[Outcome]) -> Iterator[Goal]:
    piles = Summary.of(bodies).piles
    yield from _at_most(f"{BODIES}: mean error", piles.mean_error, BODIES_MEAN)
    yield from _at_most(f"{BODIES}: largest error", piles.largest_error, BODIES_LARGEST)


def _compression(evaluation: Evaluation) -> Iterator[Goal]:
    for row in COMPRESSION:
        thinned = evaluation.thinned_to(row.voxel_m)
        piles = Summary.of([one for one in thinned if has_points(one)]).piles
        what = f"shapes, {THINNED_AREA_M2:g} m², voxels of {row.voxel_m:g} m: mean error"
        yield from _at_most(what, piles.mean_error, row.goal)


def _each_pile(evaluation: Evaluation) -> Iterator[Goal]:
    for kind, limit in EACH_PILE.items():
        summary = Summary.of(evaluation.of_kind(kind))
        yield from _each(f"{kind}: each pile", summary.piles, limit)
        if kind == TOUCHING:
            yield from _each(f"{kind}: total", summary.total, TOUCHING_TOTAL)
        if kind == ONE_SIDE and summary.piles.coverage is not None:
            covered = summary.piles.coverage
            verdict: Verdict = "reached" if covered == 1.0 else "missed"
            yield Goal(f"{kind}: inside its own u95", "100", covered, verdict)


def _each(what: str, errors: ErrorStatistics, limit: float) -> Iterator[Goal]:
    largest, mean = errors.largest_error, errors.mean_error
    if largest is None or mean is None:
        return
    if mean <= limit < largest:
        yield Goal(f"{what}, largest error", f"≤ {100 * limit:g}", largest, "on average")
    else:
        yield from _at_most(f"{what}, largest error", largest, limit)


def _no_pile(evaluation: Evaluation) -> Iterator[Goal]:
    for kind in NO_PILE:
        if scans := evaluation.of_kind(kind):
            right = sum(one.right for one in scans) / len(scans)
            verdict: Verdict = "reached" if right == 1.0 else "missed"
            yield Goal(f"{kind}: no pile", "100", right, verdict)


def _coverage(whole: tuple[Outcome, ...]) -> Iterator[Goal]:
    summary = Summary.of(whole)
    for what, errors in (("each pile", summary.piles), ("total", summary.total)):
        if errors.coverage is None:
            continue
        low, high = COVERAGE
        # A scan without a pile has no volume.
        if summary.total.count < COVERAGE_SCANS:
            verdict: Verdict = "too few"
        else:
            verdict = "reached" if low <= errors.coverage <= high else "missed"
        wanted = f"{100 * low:g} to {100 * high:g}"
        yield Goal(f"u95 holds the truth, {what}", wanted, errors.coverage, verdict)


def _coverage_by_kind(evaluation: Evaluation) -> Iterator[Goal]:
    low, high = KIND_COVERAGE
    for kind, summary in evaluation.summaries().items():
        share = summary.piles.coverage
        if share is not None and summary.piles.count >= KIND_PILES:
            verdict: Verdict = "reached" if low <= share <= high else "missed"
            wanted = f"{100 * low:g} to {100 * high:g}"
            yield Goal(f"u95 holds the truth, {kind}", wanted, share, verdict)


def _stable(evaluation: Evaluation) -> Iterator[Goal]:
    for kind, summary in evaluation.summaries().items():
        share = summary.piles.stable
        if share is not None:
            verdict: Verdict = "reached" if share == 1.0 else "missed"
            yield Goal(f"{kind}: stable within u95 / 3", "100", share, verdict)


def _no_worse(evaluation: Evaluation) -> Iterator[Goal]:
    """Check that no kind has a larger mean error than with the paper's method."""
    for kind, summary in evaluation.summaries().items():
        ours, paper = summary.piles.mean_error, evaluation.paper_of_kind(kind).piles.mean_error
        if ours is not None and paper is not None:
            yield from _at_most(f"{kind}: no worse than the paper", ours, paper)


def _real(real: tuple[Outcome, ...]) -> Iterator[Goal]:
    errors = Summary.of(real).piles
    yield from _at_most("real scans: largest error", errors.largest_error, REAL)
