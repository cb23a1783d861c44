"""The ablation: what each stage contributes."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, Any

from divespot.evaluate.statistics import ErrorStatistics
from divespot.reproduce import factor, paper
from divespot.reproduce.charts import Chart, Line
from divespot.reproduce.compression import LARGE, PRESETS
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Picture, Section, Table, counted, percent
from divespot.reproduce.scans import Scan, Variant
from divespot.reproduce.staging import LEAN_DEG, PEOPLE

if TYPE_CHECKING:
    from divespot.evaluate.outcome import PileOutcome
    from divespot.reproduce.found import Found, Need
    from divespot.reproduce.plan import Plan

FIRST = {"radius_m": 0.0, "scene_cluster": False}
SECOND = {"fine_radius_m": 0.0, "fine_cluster": False}
POSE, GROUND = {"level": False}, {"base": "plane"}

STAGES: dict[str, tuple[Any, tuple[float, float]]] = {
    "whole method": ({}, paper.WHOLE),
    "without the first filter": (FIRST, paper.FILTER),
    "without the second filter": (SECOND, paper.FILTER),
    "without both filters": (FIRST | SECOND, paper.FILTER),
    "without pose correction": (POSE, paper.POSE),
    "without ground calibration": (GROUND, paper.POSE),
    "without both of these": (POSE | GROUND, paper.POSE),
}
"""Settings that switch stages off, and the paper's mean error and mean square error in m6."""


def _needs(plan: Plan, preset: str, stage: str) -> list[Need]:
    changes, _ = STAGES[stage]
    name = f"{preset}, {stage}" if changes else preset
    variant = Variant(name, PRESETS[preset].tuned(**changes))
    scans = (
        Scan(scene, plan.seed, repeat, plan.density, "leaning, people")
        for scene in LARGE
        for repeat in range(plan.side_rounds)
    )
    return [(scan, variant) for scan in scans]


def needs(plan: Plan) -> list[Need]:
    """Return the scans of the large shapes, measured with each stage switched off."""
    every = [need for stage in STAGES for preset in PRESETS for need in _needs(plan, preset, stage)]
    return [*every, *factor.needs(plan, plan.density)]


def _figures(piles: list[PileOutcome]) -> tuple[float | None, float]:
    squares = ((pile.truth_m3 * pile.error) ** 2 for pile in piles)
    return ErrorStatistics.of(piles).mean_error, statistics.fmean(squares)


def rows(found: Found, plan: Plan) -> dict[str, dict[str, Any]]:
    """Return mean error and mean square error of each stage and preset."""
    return {
        stage: {
            "paper": _figures(factor.compensated(found, plan, _needs(plan, "paper", stage))),
            "default": _figures(found.piles(_needs(plan, "default", stage))),
        }
        for stage in STAGES
    }


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    table = rows(found, plan)
    return Section(
        "Ablation",
        [
            _told(plan),
            _table(table),
            _picture(table),
        ],
        {"rows": table},
        _findings(table),
    )


def _told(plan: Plan) -> str:
    return (
        f"The three shapes on 5.2 m², {counted(plan.side_rounds, 'scan')} each, with stages "
        f"switched off, {PEOPLE} people leaning over the heap for a few frames each. A filter is a "
        "radius filter and the clustering after it, of the whole scene or of the points above "
        "the ground; without the second one all of these are the pile. "
        f"Without pose correction the scan's own z is up, which leans by {LEAN_DEG:g}° in these "
        "scans (in those of the other sections by up to 4° each way). Without ground calibration "
        "the base is the fitted plane. Mean square errors are in m⁶, as the paper's figures show. "
        "The paper gives one figure for the filters and one for pose and ground."
    )


def _table(table: dict[str, dict[str, Any]]) -> Table:
    header = (
        *("stages", "`Settings.paper()`", "mean square", "`Settings()`", "mean square"),
        *("the paper", "mean square"),
    )
    texts = [
        (
            stage,
            *(
                text
                for pair in (row["paper"], row["default"], STAGES[stage][1])
                for text in (percent(pair[0]), f"{pair[1]:.2e}")
            ),
        )
        for stage, row in table.items()
    ]
    return Table(header, tuple(texts))


def _picture(table: dict[str, dict[str, Any]]) -> Picture:
    number = tuple(float(i) for i in range(len(table)))
    lines = tuple(
        Line(label, number, tuple(100 * row[preset][0] for row in table.values()))
        for preset, label in (("paper", "Settings.paper()"), ("default", "Settings()"))
    )
    theirs = Line("the paper", number, tuple(100 * STAGES[stage][1][0] for stage in table))
    names = tuple(stage.replace("without ", "-\n").replace(" ", "\n") for stage in table)
    chart = Chart("", "mean error in %", (*lines, theirs), names, log_y=True)
    return Picture("ablation", "Mean error with stages switched off", chart)


def _findings(table: dict[str, dict[str, Any]]) -> list[Finding]:
    error = {stage: row["paper"][0] for stage, row in table.items()}
    whole, filters = error["whole method"], error["without both filters"]
    first = error["without the first filter"]
    pose, ground = error["without pose correction"], error["without ground calibration"]
    default = {stage: row["default"][0] for stage, row in table.items()}
    better = [default[stage] < STAGES[stage][1][0] for stage in table]
    return [
        Finding(
            "without the first filter the error more than doubles, as in the paper",
            first > 2 * whole,
            f"{percent(whole)} to {percent(first)}; in the paper {percent(paper.WHOLE[0])} to "
            f"{percent(paper.FILTER[0])}",
            "Of few points, those of the people and those of the heap form one cluster.",
        ),
        Finding(
            "without filters the error grows",
            filters > whole,
            f"{percent(whole)} to {percent(filters)}",
            "The outliers of these scans are few, and the ground's height is a peak, not a mean.",
        ),
        Finding(
            "without pose correction it grows most",
            pose > max(whole, ground),
            f"{percent(pose)}",
        ),
        Finding(
            "pose correction weighs more than the filters",
            pose > filters,
            f"{percent(pose)} against {percent(filters)}",
            "The objects around the simulated strip (posts, boxes, people) are larger than the "
            "paper's interfering objects: without any filter they all count as pile.",
        ),
        Finding(
            "without ground calibration the error grows",
            ground > whole,
            f"{percent(whole)} to {percent(ground)}",
            "The plane was fitted again by least squares to all of the ground's points, which the "
            "paper's own refit does as well: its height then needs little calibration.",
        ),
        Finding(
            "`Settings()` is closer than the paper in every row",
            all(better),
            f"{sum(better)} of {len(better)}",
            "Not so "
            + ", ".join(stage for stage, b in zip(table, better, strict=True) if not b)
            + ": then everything above the ground is the pile, for divespot as well.",
        ),
    ]


EXPERIMENT = Experiment("ablation", section, needs)
