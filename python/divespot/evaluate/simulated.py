"""A simulated scan, measured as it is and thinned."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError
from divespot.evaluate.given import given_with
from divespot.evaluate.matching import match, one_pile
from divespot.evaluate.outcome import Outcome, PileOutcome
from divespot.io import UNITS
from divespot.kernels import voxel_downsample
from divespot.pipeline import measure
from divespot.settings import Settings
from divespot.simulate import SimulatedScan, scan

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.report import Report


@dataclass(frozen=True)
class SimulatedRound:
    """A scan of a scene, measured once for each voxel edge in `voxels_m`; 0 is the scan itself.

    With `paper`, the scan itself is also measured by the paper's method.
    """

    scene: str
    seed: int
    density: float
    voxels_m: tuple[float, ...]
    settings: Settings
    paper: bool = False

    def outcomes(self, result: dict[str, Any]) -> list[Outcome]:
        """Return the outcomes in the result of `measure_simulated`."""
        return [Outcome.from_json(kept) for kept in result["outcomes"]]

    def paper_of(self, result: dict[str, Any]) -> list[Outcome]:
        """Return the outcomes of the paper's method, if asked for."""
        return [Outcome.from_json(kept) for kept in result["paper"]]


def measure_simulated(one: SimulatedRound) -> dict[str, Any]:
    """Simulate a scan and measure it, for `run_rounds`."""
    try:
        taken = scan(one.scene, seed=one.seed, density=one.density)
    except DivespotError as error:
        raise DivespotError(f"{one.scene}, seed {one.seed}: {error}") from None
    settings = one.settings.changed(unit=_unit(taken)).changed(**given_with(taken))
    outcomes = [_measured(taken, voxel_m, settings) for voxel_m in one.voxels_m]
    paper = Settings.paper(unit=settings.unit, threads=settings.threads)
    # The paper's method has no outline and no given floor.
    known = one.paper and taken.scene.vessel is None
    by_paper = [_measured(taken, 0.0, paper)] if known else []
    return {
        "outcomes": [dataclasses.asdict(outcome) for outcome in outcomes],
        "paper": [dataclasses.asdict(outcome) for outcome in by_paper],
    }


def _unit(taken: SimulatedScan) -> str:
    return next(name for name, metres in UNITS.items() if metres == taken.scene.unit_m)


def _measured(taken: SimulatedScan, voxel_m: float, settings: Settings) -> Outcome:
    points = _thinned(taken, voxel_m)
    begin = time.perf_counter()
    report, failure = None, None
    try:
        report = measure(points, settings)
    except DivespotError as error:
        failure = str(error)
    seconds = time.perf_counter() - begin
    piles, extras = (one_pile if settings.stages.select == "largest" else match)(taken, report)
    return Outcome(
        scene=taken.scene.name,
        seed=taken.seed,
        voxel_m=voxel_m,
        points=len(points),
        kept=len(points) / len(taken.points),
        piles=tuple(piles),
        extras=tuple(extras),
        total=_total(taken, report),
        failure=failure,
        seconds=seconds,
    )


def _total(taken: SimulatedScan, report: Report | None) -> PileOutcome | None:
    if not taken.volumes_m3:
        return None
    if report is None or not report.piles:
        return PileOutcome(taken.volume_m3)
    return PileOutcome(taken.volume_m3, report.total.volume_m3, report.total.u95_m3)


def _thinned(taken: SimulatedScan, voxel_m: float) -> NDArray[np.float64]:
    if voxel_m == 0.0:
        return taken.points
    thinned: NDArray[np.float64] = voxel_downsample(taken.points, voxel_m / taken.scene.unit_m)
    return thinned
