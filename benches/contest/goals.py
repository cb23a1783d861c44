"""The figures aimed at, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from contest.match import Outcome


class Results:
    """Outcomes by kernel, program and number of points."""

    def __init__(self, outcomes: list[Outcome]) -> None:
        self.found = {(o.kernel, o.title, o.count): o for o in outcomes}

    def seconds(self, kernel: str, title: str, count: int) -> float | None:
        """Return the best time, None where there is none."""
        outcome = self.found.get((kernel, title, count))
        return outcome and outcome.best_s

    def times(self, kernel: str, rival: str, count: int) -> float | None:
        """Return how many times longer a rival takes."""
        return quotient(self.seconds(kernel, rival, count), self.seconds(kernel, "divespot", count))

    def growth(self, kernel: str, count: int, more: int) -> float | None:
        """Return how many times longer more points take."""
        times = (self.seconds(kernel, "divespot", n) for n in (more, count))
        return quotient(*times)

    def peak_mb(self, kernel: str, count: int) -> float | None:
        """Return divespot's peak of memory."""
        outcome = self.found.get((kernel, "divespot", count))
        return outcome and outcome.peak_mb


def quotient(a: float | None, b: float | None) -> float | None:
    """Divide where there is something to divide."""
    return a / b if a is not None and b is not None else None


@dataclass(frozen=True)
class Goal:
    """A figure aimed at, and how to take it from the results."""

    text: str
    aim: float
    figure: Callable[[Results], float | None]
    unit: str = "×"
    at_least: bool = True

    def line(self, results: Results) -> str | None:
        """Return a row of the table; None where the run does not tell."""
        figure = self.figure(results)
        if figure is None:
            return None
        reached = figure >= self.aim if self.at_least else figure <= self.aim
        sign = "≥" if self.at_least else "≤"
        verdict = "reached" if reached else "**missed**"
        aim, found = f"{self.aim:g} {self.unit}", f"{figure:.3g} {self.unit}"
        return f"| {self.text} | {sign} {aim} | {found} | {verdict} |"


def at_most(text: str, aim: float, figure: Callable[[Results], float | None], unit: str) -> Goal:
    """Make a goal that is reached from above."""
    return Goal(text, aim, figure, unit, at_least=False)


K, M = 1000, 1_000_000
GOALS = (
    Goal(
        "HDBSCAN, 300k, against hdbscan exact",
        60,
        lambda r: r.times("hdbscan", "hdbscan, exact", 300 * K),
    ),
    Goal(
        "HDBSCAN, 300k, against fast_hdbscan",
        18,
        lambda r: r.times("hdbscan", "fast_hdbscan", 300 * K),
    ),
    at_most("HDBSCAN, 300k, peak memory", 60, lambda r: r.peak_mb("hdbscan", 300 * K), "MB"),
    at_most("HDBSCAN, 1M against 100k", 13, lambda r: r.growth("hdbscan", 100 * K, M), "×"),
    at_most(
        "HDBSCAN, 300k, min_samples 50 against 10",
        2,
        lambda r: r.times("hdbscan", "divespot, min_samples 50", 300 * K),
        "×",
    ),
    Goal("radius filter, 300k, against Open3D", 20, lambda r: r.times("radius", "Open3D", 300 * K)),
    Goal(
        "radius filter, 300k, against SciPy",
        30,
        lambda r: r.times("radius", "SciPy cKDTree", 300 * K),
    ),
    Goal(
        "voxel downsampling, 300k, against Open3D", 3, lambda r: r.times("voxel", "Open3D", 300 * K)
    ),
    Goal("plane fit, 300k, against Open3D", 10, lambda r: r.times("plane", "Open3D", 300 * K)),
    Goal(
        "measure, 400k, against Open3D + hdbscan",
        350,
        lambda r: r.times("pipeline", "Open3D + hdbscan", 400 * K),
    ),
    at_most(
        "measure, 400k, a million points",
        0.6,
        lambda r: quotient(r.seconds("pipeline", "divespot", 400 * K), 0.4),
        "s",
    ),
    at_most("measure, 4M against 400k", 11, lambda r: r.growth("pipeline", 400 * K, 4 * M), "×"),
)


def table(outcomes: list[Outcome]) -> list[str]:
    """Return the lines of the table of goals that this run decides."""
    results = Results(outcomes)
    lines = [line for goal in GOALS if (line := goal.line(results))]
    head = ["| figure | aim | measured | |", "|---|---|---|---|"]
    return ["## Figures aimed at", "", *head, *lines, ""] if lines else []
