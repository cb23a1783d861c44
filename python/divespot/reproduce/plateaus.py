"""The floor after each step of the registration: plateaus in the histogram of heights."""

from __future__ import annotations

import statistics
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from divespot.reproduce.charts import Chart, Line
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.floor_rounds import BIN_M, SETTINGS, STEPS, FloorRound
from divespot.reproduce.page import Finding, Picture, Section, Table, counted, percent
from divespot.reproduce.staging import PLATEAUS_M

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from divespot.reproduce.found import Found
    from divespot.reproduce.plan import Plan

    Row = dict[str, Any]

#: One shape of each area.
SHAPES = ("shape-05", "shape-11", "shape-17")
#: Errors of the frames' ranges, by the scene's stage.
CAMERAS: Mapping[str, str] = MappingProxyType(
    {"as it is": "1 mm", "plateaus": f"{1000 * PLATEAUS_M:.0f} mm"}
)
#: The scan whose histogram is drawn: that with the longest rail.
SHOWN = (SHAPES[-1], "plateaus")
#: A floor counts as level if the frames' floors are within this.
LEVEL_M = 0.001


def rounds(plan: Plan) -> list[FloorRound]:
    """Return a shape of each area, `side_rounds` times with each camera."""
    return [
        FloorRound(name, stage, plan.seed, repeat, plan.side_density)
        for stage in CAMERAS
        for name in SHAPES
        for repeat in range(plan.side_rounds)
    ]


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    results = {one: found.results[one] for one in rounds(plan)}
    rows = [
        _row(stage, step, [r for one, r in results.items() if one.stage == stage])
        for stage in CAMERAS
        for step in STEPS
    ]
    shown = next(r for one, r in results.items() if (one.floor_of, one.stage) == SHOWN)
    histograms = {step: one["histogram"] for step, one in shown.items() if one is not None}
    return Section(
        "When the ground becomes uneven, from depth frames",
        [_told(plan), _table(rows), _picture(histograms)],
        {"rows": rows, "histograms": histograms},
        _findings(rows),
    )


def _row(stage: str, step: str, results: Sequence[Row]) -> Row:
    """Return means over scans; those with a frame that cannot be registered are only counted."""
    seen = [one for result in results if (one := result[step]) is not None]
    return {
        "stage": stage,
        "step": step,
        "lost": len(results) - len(seen),
        "peaks": _mean([one["peaks"] for one in seen]),
        "spacing_m": _mean([one["spacing_m"] for one in seen if one["spacing_m"] is not None]),
        "width_m": _mean([one["width_m"] for one in seen]),
        "apart_m": _mean([one["apart_m"] for one in seen]),
        "ground_m": {
            rule: _mean([abs(one["ground_m"][rule]) for one in seen])
            for rule in ("peak", "midpoint")
        },
        "mean_error": {
            name: _mean([abs(one["errors"][name]) for one in seen]) for name in SETTINGS
        },
    }


def _mean(values: Sequence[float]) -> float | None:
    return statistics.fmean(values) if values else None


def _told(plan: Plan) -> str:
    return (
        f"{len(SHAPES)} of the shapes, a rail's frames {counted(plan.side_rounds, 'time')} each, "
        "by a camera whose frames are off each other by 1 mm, as may be expected, and by one whose "
        f"frames are off by {1000 * PLATEAUS_M:.0f} mm; both measure 4 mm too long. With true "
        "poses nothing was registered; then each frame is registered to the previous one only, to "
        "all earlier ones, and all are solved for together, with the ranges' offsets and the floor "
        f"as one surface. Heights are counted in bins of {1000 * BIN_M:.0f} mm; a peak is, as in "
        "the paper's midpoint, at least half as high as the highest; `wide` is the histogram's "
        "width at that height, `apart` the differences between the floors of single frames. `Off` "
        "is the distance of the paper's ground from the exact floor, known from the cameras' true "
        "positions. Errors are without a factor."
    )


def _table(rows: Sequence[Row]) -> Table:
    header = (
        *("frames off by, step", "peaks", "spacing mm", "wide mm", "apart mm"),
        *("peak off mm", "midpoint off mm"),
        *("paper, peak", "paper, midpoint", "`Settings()`"),
    )
    texts = tuple(
        (
            f"{CAMERAS[row['stage']]}, {STEPS[row['step']]}",
            "-" if row["peaks"] is None else f"{row['peaks']:.1f}",
            *(_mm(row[name]) for name in ("spacing_m", "width_m", "apart_m")),
            *map(_mm, row["ground_m"].values()),
            *map(percent, row["mean_error"].values()),
        )
        for row in rows
    )
    return Table(header, texts)


def _mm(length_m: float | None) -> str:
    return "-" if length_m is None else f"{1000 * length_m:.1f}"


def _picture(histograms: Mapping[str, Row]) -> Picture:
    lines = tuple(
        Line(STEPS[step], tuple(one["heights_mm"]), tuple(one["shares"]))
        for step, one in histograms.items()
    )
    chart = Chart("height over the exact floor in mm", "share of the highest bin", lines)
    caption = f"Heights of the floor of {SHOWN[0]}, frames off by {CAMERAS[SHOWN[1]]}"
    return Picture("plateaus", caption, chart)


def _findings(rows: Sequence[Row]) -> list[Finding]:
    by = {(row["stage"], row["step"]): row for row in rows}
    true, chained, solved = (by["plateaus", step] for step in ("true", "chained", "solved"))
    both = [by[stage, "solved"] for stage in CAMERAS]
    return [
        Finding(
            "frames that are off each other split the floor into plateaus",
            _or(true["peaks"], 0.0) > 1.0,
            f"{_or(true['peaks'], 0.0):.1f} peaks, {_mm(true['spacing_m'])} mm apart",
            "The bins are too wide, or the frames too many, to separate the plateaus.",
        ),
        Finding(
            "there the midpoint is the better ground",
            _or(true["ground_m"]["midpoint"]) < _or(true["ground_m"]["peak"]),
            f"off by {_mm(true['ground_m']['midpoint'])} mm against "
            f"{_mm(true['ground_m']['peak'])} mm",
            "The plateaus need not be centred on the exact floor.",
        ),
        Finding(
            "registration of each frame on the one before closes the steps",
            _or(chained["apart_m"]) < 0.5 * _or(true["apart_m"]),
            f"{_mm(true['apart_m'])} mm to {_mm(chained['apart_m'])} mm",
        ),
        Finding(
            "solved for together, the floors of frames are one level where the exact floor is",
            all(max(_or(r["apart_m"]), _or(r["ground_m"]["midpoint"])) < LEVEL_M for r in both),
            f"{_mm(solved['apart_m'])} mm apart, off by {_mm(solved['ground_m']['midpoint'])} mm",
            "A common offset is rejected if it is larger than depth cameras have, and few pixels "
            "determine it badly.",
        ),
    ]


def _or(value: float | None, missing: float = float("inf")) -> float:
    return missing if value is None else value


EXPERIMENT = Experiment("plateaus", section, rounds=rounds)
