"""Scans of known volume, measured, and the results."""

from __future__ import annotations

import fnmatch
import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot._arguments import number, require_kind, seed_number, switch, whole, word
from divespot.errors import DivespotError
from divespot.evaluate.known import measure_known, read_list
from divespot.evaluate.rounds import run_rounds
from divespot.evaluate.simulated import SimulatedRound, measure_simulated
from divespot.evaluate.statistics import Summary
from divespot.settings import Settings
from divespot.simulate import NAMES
from divespot.simulate.families import FAMILIES, OF_KIND
from divespot.simulate.shapes import ROWS

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Sequence

    from divespot.evaluate.outcome import Outcome

SHAPES, BODIES = "18 shapes", "18 shapes, body over"
"""Kinds of scenes: the paper's shapes, and the same with somebody leaning over the pile."""
GROUPS = {kind: f"{kind}-*" for kind in OF_KIND if kind not in {"body", "cut"}}
"""Names for all scenes of a family of kinds together, and the pattern that selects them."""
MOST_SEEDS = 1_000_000
"""Largest number of seeds of one evaluation."""
VOXELS_M = (0.01, 0.02, 0.05, 0.1, 0.2, 0.3)
"""Edges of the voxels with which the paper's shapes are thinned (paper, compression table)."""
THINNED_AREA_M2 = 5.2
"""Area of the shapes of the paper's compression table, whose error at full density is 2.03 %. The
smaller shapes have only four points per pile after thinning."""
VARIED_TIMES = 4
"""Scans of a randomly drawn scene for one scan of any other scene; the paper's shapes are many."""


@dataclass(frozen=True)
class Evaluation:
    """The results of all scans: simulated scans, the same thinned, and real scans.

    `paper` holds results of the paper's method on the simulated scans, if asked for.
    """

    whole: tuple[Outcome, ...]
    thinned: tuple[Outcome, ...]
    real: tuple[Outcome, ...]
    paper: tuple[Outcome, ...] = ()

    def summaries(self) -> dict[str, Summary]:
        """Return the summary of each kind of the simulated scans."""
        return {kind: Summary.of(self.of_kind(kind)) for kind in self.kinds()}

    def kinds(self) -> list[str]:
        """Return the kinds of the simulated scans in order, those of several scenes last."""
        kinds = dict.fromkeys(kind for one in self.whole for kind in kinds_of(one.scene))
        return sorted(kinds, key=lambda kind: kind in GROUPS.values())

    def thinned_to(self, voxel_m: float) -> list[Outcome]:
        """Return the outcomes of the shapes thinned with voxels of this edge."""
        return [one for one in self.thinned if one.voxel_m == voxel_m]

    def of_kind(self, kind: str) -> list[Outcome]:
        """Return the outcomes of the simulated scans of a kind (`kinds_of`)."""
        return [one for one in self.whole if kind in kinds_of(one.scene)]

    def paper_of_kind(self, kind: str) -> Summary:
        """Return the summary of the paper's method on a kind."""
        return Summary.of([one for one in self.paper if kind in kinds_of(one.scene)])


def has_points(one: Outcome) -> bool:
    """Return whether a thinned shape is in the paper's compression table."""
    return ROWS[one.scene][0] == THINNED_AREA_M2


def kinds_of(scene: str) -> tuple[str, ...]:
    """Return the kinds of a scene: its own name or that of the shapes, and its group."""
    if scene in ROWS:
        return (SHAPES, f"shapes, {ROWS[scene][0]} m²")
    if scene in OF_KIND["body"]:
        return (BODIES,)
    group = (GROUPS[kind] for kind, names in OF_KIND.items() if kind in GROUPS and scene in names)
    return (scene, *group)


def evaluate(  # noqa: PLR0913 - what there is to choose
    scenes: Sequence[str] | None = None,
    *,
    seeds: int = 5,
    first_seed: int = 0,
    density: float = 1.0,
    scans: str | os.PathLike[str] | None = None,
    settings: Settings | None = None,
    paper: bool = False,
    repeat: bool = False,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    on_round: Callable[[int, int], None] | None = None,
) -> Evaluation:
    """Measure scans of known volume.

    Parameters
    ----------
    scenes
        Names of simulated scenes (`divespot.simulate.NAMES`), with * as wildcard; all of them
        unless these or `scans` are given. The paper's shapes are also measured thinned.
    seeds, first_seed
        Number of scans of each scene, and their first seed; randomly drawn scenes are scanned
        `VARIED_TIMES` as often. Seeds of 4000 and above are for checking: no constant of divespot
        was fitted on them.
    density
        Number of points of a simulated scan, relative to the scene's own.
    scans
        A list of real scans (`divespot.evaluate.read_list`).
    settings
        Settings of the measurement; by default `Settings()`.
    paper
        Also measure the simulated scans by the paper's method.
    repeat
        Also measure slightly changed scans, as the setting of that name does: five times the
        work.
    jobs, folder
        Number of processes, and where finished rounds are kept (`divespot.evaluate.run_rounds`).
    on_round
        Called with the number of finished rounds and the number of all rounds.

    Raises
    ------
    DivespotError
        There is no such scene or no seed, or the list or the folder cannot be used.

    """
    if whole("seeds", seeds, MOST_SEEDS) < 1:
        raise DivespotError(f"seeds is {seeds}: a whole number of 1 or more is needed")
    seed_number(first_seed)
    number("density", density)
    by_paper = switch("paper", paper)
    if settings is not None:
        require_kind("settings", settings, Settings)
    chosen = (settings or Settings()).changed(repeat=switch("repeat", repeat))
    everything = ("*",) if scans is None else ()
    names = _names(everything if scenes is None else scenes)
    simulated = [
        SimulatedRound(
            name, seed, density, (0.0, *VOXELS_M) if name in ROWS else (0.0,), chosen, by_paper
        )
        for name in names
        for seed in range(first_seed, first_seed + seeds * _times(name))
    ]
    known = [] if scans is None else read_list(scans, chosen)
    done = itertools.count(1)

    def tell() -> None:
        if on_round is not None:
            on_round(next(done), len(simulated) + len(known))

    results = run_rounds(measure_simulated, simulated, jobs=jobs, folder=folder, on_done=tell)
    measured = [one for r, kept in zip(simulated, results, strict=True) for one in r.outcomes(kept)]
    papers = [one for r, kept in zip(simulated, results, strict=True) for one in r.paper_of(kept)]
    results = run_rounds(measure_known, known, jobs=jobs, folder=folder, on_done=tell)
    real = [one for r, kept in zip(known, results, strict=True) for one in r.outcomes(kept)]
    return Evaluation(
        whole=tuple(one for one in measured if one.voxel_m == 0.0),
        thinned=tuple(one for one in measured if one.voxel_m > 0.0),
        real=tuple(real),
        paper=tuple(papers),
    )


def _times(name: str) -> int:
    """Return how often a scene is scanned for each seed asked for."""
    return VARIED_TIMES if name in FAMILIES and name not in OF_KIND["body"] else 1


def _names(patterns: Sequence[str]) -> list[str]:
    found = {pattern: fnmatch.filter(NAMES, word("scenes", pattern)) for pattern in patterns}
    for pattern, names in found.items():
        if not names:
            raise DivespotError(
                f"there is no scene {pattern!r}: one of {', '.join(NAMES)} is needed"
            )
    return list(dict.fromkeys(name for names in found.values() for name in names))
