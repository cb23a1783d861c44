"""One kernel, one cloud, all programs by turns."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from contest.worker import LIMIT_S, TooSlowError, Worker

if TYPE_CHECKING:
    from contest.clouds import Cloud

#: No further run of a program begins once its runs took this long.
BUDGET_S = 120.0


@dataclass(frozen=True)
class Program:
    """Who takes part, and where its task is: ``module:function``."""

    title: str
    function: str


#: For each kernel divespot first, then its rivals.
PROGRAMS = {
    "radius": (
        Program("divespot", "by_divespot:radius"),
        Program("Open3D", "by_open3d:radius"),
        Program("SciPy cKDTree", "by_scipy:radius"),
        Program("scikit-learn KDTree", "by_sklearn:radius"),
    ),
    "hdbscan": (
        Program("divespot", "by_divespot:hdbscan"),
        Program("hdbscan, exact", "by_hdbscan:hdbscan"),
        Program("fast_hdbscan", "by_fast_hdbscan:hdbscan"),
        Program("divespot, min_samples 50", "by_divespot:hdbscan_50"),
    ),
    "voxel": (
        Program("divespot", "by_divespot:voxel"),
        Program("Open3D", "by_open3d:voxel"),
    ),
    "plane": (
        Program("divespot", "by_divespot:plane"),
        Program("Open3D", "by_open3d:plane"),
        Program("Open3D, early exit", "by_open3d:plane_early_exit"),
    ),
    "pipeline": (
        Program("divespot", "by_divespot:pipeline"),
        Program("divespot, Settings.paper()", "by_divespot:paper_pipeline"),
        Program("Open3D + hdbscan", "by_hand:pipeline"),
    ),
}


@dataclass
class Outcome:
    """What became of one program on one cloud."""

    kernel: str
    title: str
    count: int
    seconds: list[float] = field(default_factory=list)
    peak_mb: float = 0.0
    answer: Any = None
    remark: str = ""

    @property
    def best_s(self) -> float | None:
        """The shortest run; None where none ended."""
        return min(self.seconds, default=None)


def play(kernel: str, cloud: Cloud, repeats: int, earlier: list[Outcome]) -> list[Outcome]:
    """Let the programs run by turns, so that what else the machine does hits all alike."""
    outcomes = [Outcome(kernel, program.title, cloud.count) for program in PROGRAMS[kernel]]
    players: dict[str, Worker] = {}
    try:
        for outcome, program in zip(outcomes, PROGRAMS[kernel], strict=True):
            outcome.remark = hopeless(outcome, earlier)
            if not outcome.remark:
                players[program.title] = Worker(program.function, cloud)
        for outcome in outcomes * repeats:
            turn(outcome, players)
        for outcome in outcomes:
            if outcome.title in players:
                outcome.answer = players.pop(outcome.title).finish()
    finally:
        for player in players.values():
            player.kill()
    return outcomes


def turn(outcome: Outcome, players: dict[str, Worker]) -> None:
    """Let one program run once, if it is still in the contest and within its budget."""
    if outcome.title not in players or sum(outcome.seconds) > BUDGET_S:
        return
    try:
        seconds, peak_mb = players[outcome.title].run()
    except TooSlowError:
        outcome.remark = f"given up after {LIMIT_S:.0f} s"
        players.pop(outcome.title).kill()
    except EOFError:
        outcome.remark = "ended with an error"
        players.pop(outcome.title).kill()
    else:
        # Later runs find memory that the first one left to the process.
        outcome.peak_mb = outcome.peak_mb or peak_mb
        outcome.seconds.append(seconds)


def hopeless(outcome: Outcome, earlier: list[Outcome]) -> str:
    """Return why a program need not try, given what became of it on smaller clouds."""
    same = (outcome.kernel, outcome.title)
    for last in reversed([o for o in earlier if (o.kernel, o.title) == same]):
        if last.best_s is None:
            return f"not tried: too slow at {last.count:,} points"
        expected_s = last.best_s * outcome.count / last.count
        if expected_s > LIMIT_S:
            return f"not tried: over {expected_s:,.0f} s to be expected"
        break
    return ""
