"""The table of the 18 shapes."""

from __future__ import annotations

import dataclasses
import statistics
from typing import TYPE_CHECKING

from divespot.evaluate.statistics import ErrorStatistics
from divespot.reproduce import factor, paper
from divespot.reproduce.charts import Chart, Line
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Picture, Section, Table, counted, cubic, percent
from divespot.reproduce.scans import OURS, Scan, Variant
from divespot.simulate.shapes import ROWS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from divespot.evaluate.outcome import PileOutcome
    from divespot.reproduce.found import Found, Need
    from divespot.reproduce.plan import Plan

OUR = Variant("default", OURS)
PAPERS = factor.VARIANT
AREAS = tuple(paper.AREAS)


def _scans(plan: Plan, name: str) -> list[Scan]:
    return [Scan(name, plan.seed, repeat, plan.density) for repeat in range(plan.rounds)]


def needs(plan: Plan) -> list[Need]:
    """Return every shape with both presets, and the scans of the factor."""
    pairs = [(scan, v) for name in ROWS for scan in _scans(plan, name) for v in (OUR, PAPERS)]
    return [*pairs, *factor.needs(plan, plan.density)]


@dataclasses.dataclass(frozen=True)
class Row:
    """A shape: truth, mean estimates and the statistics of both presets."""

    area_m2: float
    truth_m3: float
    ours_m3: float
    ours: ErrorStatistics
    papers_m3: float
    papers: ErrorStatistics


def rows(found: Found, plan: Plan) -> list[Row]:
    """Return a row for each shape."""
    return [_row(found, plan, name, area) for name, (area, _, _) in ROWS.items()]


def _row(found: Found, plan: Plan, name: str, area: float) -> Row:
    scans = _scans(plan, name)
    ours = found.piles((scan, OUR) for scan in scans)
    papers = factor.compensated(found, plan, ((scan, PAPERS) for scan in scans))
    return Row(
        area,
        statistics.fmean(pile.truth_m3 for pile in ours),
        _mean(ours),
        ErrorStatistics.of(ours),
        _mean(papers),
        ErrorStatistics.of(papers),
    )


def _mean(piles: Iterable[PileOutcome]) -> float:
    return statistics.fmean(pile.volume_m3 or 0.0 for pile in piles)


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    found_rows = rows(found, plan)
    return Section(
        "Eighteen shapes",
        [
            _told(found, plan),
            _table(found_rows),
            "Mean errors by area:",
            _areas(found_rows),
            _picture(found_rows),
        ],
        {"factors": _factors(found, plan), "rows": [dataclasses.asdict(row) for row in found_rows]},
        _findings(found_rows),
    )


def _told(found: Found, plan: Plan) -> str:
    factors = ", ".join(f"{by:.4f} on {area} m²" for area, by in _factors(found, plan).items())
    return (
        "Each shape is one simulated corn pile of exactly known volume, scanned "
        f"{counted(plan.rounds, 'time')} with fresh noise and registration (the paper: 50 real "
        "scans of real piles). `Settings()` is divespot as it is, without any factor. "
        f"`Settings.paper()` is the paper's method with a compensation factor ({factors}), which "
        f"this command calibrated on {len(factor.needs(plan, plan.density))} scans of other piles "
        f"(seed {plan.other_seed}). u95 is the median expanded uncertainty that divespot reports, "
        "held the share of the scans with the truth within u95."
    )


def _factors(found: Found, plan: Plan) -> dict[str, float]:
    return {str(area): factor.factor(found, plan, plan.density, area) for area in AREAS}


def _table(found_rows: list[Row]) -> Table:
    header = (
        *("shape", "area m²", "true m³", "ours m³", "error", "u95", "held"),
        *("paper's method m³", "error", "paper m³", "error"),
    )
    texts = [
        (
            *(str(i), f"{row.area_m2}", cubic(row.truth_m3), cubic(row.ours_m3)),
            *map(percent, (row.ours.mean_error, row.ours.median_u95, row.ours.coverage)),
            *(cubic(row.papers_m3), percent(row.papers.mean_error)),
            *(cubic(theirs[0]), percent(theirs[1])),
        )
        for i, (row, theirs) in enumerate(zip(found_rows, paper.SHAPES, strict=True), start=1)
    ]
    return Table(header, tuple(texts))


def by_area(found_rows: list[Row], area_m2: float) -> tuple[float, float]:
    """Return the mean errors of both presets over an area's shapes."""
    chosen = [row for row in found_rows if row.area_m2 == area_m2]
    ours = statistics.fmean(row.ours.mean_error or 0.0 for row in chosen)
    return ours, statistics.fmean(row.papers.mean_error or 0.0 for row in chosen)


def _areas(found_rows: list[Row]) -> Table:
    texts = [
        (f"{area}", *map(percent, (*by_area(found_rows, area), paper.AREAS[area])))
        for area in AREAS
    ]
    return Table(("area m²", "`Settings()`", "`Settings.paper()`", "the paper"), tuple(texts))


def _picture(found_rows: list[Row]) -> Picture:
    number = tuple(float(i) for i in range(len(found_rows)))
    errors = {
        "Settings()": [row.ours.mean_error or 0.0 for row in found_rows],
        "Settings.paper()": [row.papers.mean_error or 0.0 for row in found_rows],
        "the paper": [error for _, error in paper.SHAPES],
    }
    lines = tuple(Line(n, number, tuple(100 * e for e in errors[n])) for n in errors)
    names = tuple(str(i) for i in range(1, len(found_rows) + 1))
    chart = Chart("shape", "mean error in %", lines, names)
    return Picture("shapes", "Mean error of each shape", chart)


def _findings(found_rows: list[Row]) -> list[Finding]:
    better = [
        (row.ours.mean_error or 0.0) < error
        for row, (_, error) in zip(found_rows, paper.SHAPES, strict=True)
    ]
    behind = ", ".join(str(i) for i, ok in enumerate(better, start=1) if not ok)
    worst = max(by_area(found_rows, area)[1] for area in AREAS)
    return [
        Finding(
            "`Settings()` is closer than the paper in every row",
            all(better),
            f"{sum(better)} of {len(better)}" + (f", not in shape {behind}" if behind else ""),
        ),
        Finding(
            f"`Settings.paper()` stays within the paper's {percent(paper.WITHIN)} on every area",
            worst <= paper.WITHIN,
            f"at most {percent(worst)}",
            "One global peak of the histogram includes the registration errors of the scan: a "
            "factor corrects the mean, not the spread.",
        ),
    ]


EXPERIMENT = Experiment("shapes", section, needs)
