"""Measured times: of each stage, and against the size of the scene."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import divespot
from divespot.pipeline import measure
from divespot.reproduce import paper
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.growth import METHODS, GrowingTimeRound, growth_picture, sizes_table
from divespot.reproduce.page import Section, Table
from divespot.reproduce.scans import Scan
from divespot.settings import Settings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.reproduce.found import Found, Round
    from divespot.reproduce.plan import Plan

PRESETS = {"default": Settings(), "paper": Settings.paper()}
LABELS = {"default": "`Settings()`", "paper": "`Settings.paper()`"}
RUNS = 3


@dataclass(frozen=True)
class StagesRound:
    """A scan reduced to a number of points, and the shortest of some times of each stage."""

    stages_of: Scan
    points: int

    def result(self) -> dict[str, Any]:
        """Return the seconds of each stage with each preset."""
        points = self.stages_of.take().points
        few = min(self.points, len(points))
        chosen = np.random.default_rng(self.stages_of.seed).choice(len(points), few, replace=False)
        cut = points[np.sort(chosen)]
        return {"points": few, "timings_s": {name: _best(cut, s) for name, s in PRESETS.items()}}


def _best(points: NDArray[np.float64], settings: Settings) -> dict[str, float]:
    runs = [dict(measure(points, settings).timings_s) for _ in range(RUNS)]
    return min(runs, key=lambda run: sum(run.values()))


def _stages(plan: Plan) -> StagesRound:
    return StagesRound(Scan("shape-16", plan.seed, 0, plan.density), plan.time_points)


def rounds(plan: Plan) -> list[Round]:
    """Return both presets, and both methods at each size, to be run one after the other."""
    growing = [GrowingTimeRound(method, n) for method in METHODS for n in plan.layers]
    return [_stages(plan), *growing]


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    result = found.results[_stages(plan)]
    timings, points = result["timings_s"], result["points"]
    growing = {
        method: [float(found.results[GrowingTimeRound(method, n)]["seconds"]) for n in plan.layers]
        for method in METHODS
    }
    theirs = " and ".join(f"{s} s on a {board}" for board, s in paper.RUNNING_S.items())
    machine = f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}"
    return Section(
        "Measured times",
        [
            (
                "Only this section changes from run to run. Times are wall clock, the shortest of "
                f"{RUNS} runs, on {machine}, NumPy {np.__version__}, divespot "
                f"{divespot.__version__}."
            ),
            (
                f"A scan of shape 16 with {points:,} points, in seconds by stage. The paper gives "
                f"{theirs} for 300,000 points; those are its figures on other hardware, and say "
                "nothing about this one."
            ),
            _table(timings),
            "Time of the two methods against the size of the scene, as in the section on memory:",
            sizes_table(growing, plan.layers, "s", 1.0),
            growth_picture("time", "time in s", growing, plan.layers, 1.0),
        ],
        {"points": points, "timings_s": timings, "layers": plan.layers, "seconds": growing},
    )


def _table(timings: dict[str, dict[str, float]]) -> Table:
    stages = dict.fromkeys(stage for run in timings.values() for stage in run)
    texts = [
        (stage, *(f"{run.get(stage, 0.0):.4f}" for run in timings.values())) for stage in stages
    ]
    total = ("all stages", *(f"{sum(run.values()):.3f}" for run in timings.values()))
    return Table(("stage", *(LABELS[preset] for preset in timings)), (*texts, total))


EXPERIMENT = Experiment("running", section, rounds=rounds)
