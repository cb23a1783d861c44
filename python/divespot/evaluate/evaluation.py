"""Scans of known volume, measured, and what came of it."""

from __future__ import annotations

import fnmatch
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from divespot.errors import DivespotError
from divespot.evaluate.known import KnownRound, measure_known, read_list
from divespot.evaluate.rounds import run_rounds
from divespot.evaluate.simulated import SimulatedRound, measure_simulated
from divespot.evaluate.statistics import Summary
from divespot.settings import Settings
from divespot.simulate import NAMES
from divespot.simulate.shapes import ROWS
from divespot.simulate.varied import VARIED

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from divespot.evaluate.outcome import Outcome
    from divespot.evaluate.rounds import Json

R = TypeVar("R", SimulatedRound, KnownRound)

SHAPES = "18 shapes"
"""Kind of the scenes of the paper's shapes."""
VOXELS_M = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3)
"""Edges of the voxels that the paper's shapes are thinned with (paper, compression table)."""
THINNED_AREA_M2 = 5.2
"""Area of the shapes of the paper's compression table: 2.03 % at full density is the error of
these. The smaller ones are left with four points a pile."""
VARIED_TIMES = 4
"""Scans of a scene drawn at random for one of a scene of one kind."""


@dataclass(frozen=True)
class Evaluation:
    """What came of all scans: simulated ones as they are, the same thinned, and real ones."""

    whole: tuple[Outcome, ...]
    thinned: tuple[Outcome, ...]
    real: tuple[Outcome, ...]

    def summaries(self) -> dict[str, Summary]:
        """Return the summary of each kind among the whole scans, in the order of the scenes."""
        kinds = dict.fromkeys(kind for one in self.whole for kind in kinds_of(one.scene))
        return {kind: Summary.of(self.of_kind(kind)) for kind in kinds}

    def thinned_to(self, voxel_m: float) -> list[Outcome]:
        """Return the outcomes of the shapes thinned with voxels of this edge."""
        return [one for one in self.thinned if one.voxel_m == voxel_m]

    def of_kind(self, kind: str) -> list[Outcome]:
        """Return the outcomes of the whole scans of a kind (`kinds_of`)."""
        return [one for one in self.whole if kind in kinds_of(one.scene)]


def has_points(one: Outcome) -> bool:
    """Return whether a thinned shape is one of those in the paper's compression table."""
    return ROWS[one.scene][0] == THINNED_AREA_M2


def kinds_of(scene: str) -> tuple[str, ...]:
    """Return the kinds that a scene counts among: its own name, or the paper's shapes."""
    if scene in ROWS:
        return (SHAPES, f"shapes, {ROWS[scene][0]} m²")
    return (scene,)


def evaluate(  # noqa: PLR0913 - what there is to choose
    scenes: Sequence[str] | None = None,
    *,
    seeds: int = 5,
    first_seed: int = 0,
    density: float = 1.0,
    scans: str | os.PathLike[str] | None = None,
    settings: Settings | None = None,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    on_round: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Measure scans of known volume.

    Parameters
    ----------
    scenes
        Names of simulated scenes (`divespot.simulate.NAMES`), with * for any letters; all of
        them unless these or `scans` are given. The paper's shapes are measured thinned as well.
    seeds, first_seed
        How many scans of each scene, and their first seed; scenes that are drawn at random are
        scanned `VARIED_TIMES` as often. Seeds from 1000 are for checking: nothing in divespot
        was chosen by looking at them.
    density
        Points of a simulated scan, relative to the scene's own.
    scans
        A list of real scans (`divespot.evaluate.read_list`).
    settings
        Settings of the measurement; `Settings()` unless given.
    jobs, folder
        Processes, and where finished rounds are kept (`divespot.evaluate.run_rounds`).
    on_round
        Called with the number of rounds that are done and the number of all.

    Raises
    ------
    DivespotError
        There is no such scene, no seed, or the list or the folder is of no use.

    """
    if seeds < 1:
        raise DivespotError(f"seeds is {seeds}: a whole number of 1 or more is needed")
    chosen = settings or Settings()
    names = _names(("*",) if scenes is None and scans is None else scenes or ())
    simulated = [
        SimulatedRound(name, seed, density, (0.0, *VOXELS_M) if name in ROWS else (0.0,), chosen)
        for name in names
        for seed in range(first_seed, first_seed + seeds * (VARIED_TIMES if name in VARIED else 1))
    ]
    known = [] if scans is None else read_list(scans, chosen)
    done = itertools.count(1)

    def tell() -> None:
        if on_round is not None:
            on_round(next(done), len(simulated) + len(known))

    measured = _outcomes(measure_simulated, simulated, jobs=jobs, folder=folder, on_done=tell)
    real = _outcomes(measure_known, known, jobs=jobs, folder=folder, on_done=tell)
    return Evaluation(
        whole=tuple(one for one in measured if one.voxel_m == 0.0),
        thinned=tuple(one for one in measured if one.voxel_m > 0.0),
        real=tuple(real),
    )


def _names(patterns: Sequence[str]) -> list[str]:
    found = {pattern: fnmatch.filter(NAMES, pattern) for pattern in patterns}
    for pattern, names in found.items():
        if not names:
            raise DivespotError(
                f"there is no scene {pattern!r}: one of {', '.join(NAMES)} is needed"
            )
    return list(dict.fromkeys(name for names in found.values() for name in names))


def _outcomes(
    work: Callable[[R], Json],
    rounds: Sequence[R],
    **running: Any,  # noqa: ANN401 - the options of `run_rounds`
) -> list[Outcome]:
    results = run_rounds(work, rounds, **running)
    return [one for r, result in zip(rounds, results, strict=True) for one in r.outcomes(result)]
