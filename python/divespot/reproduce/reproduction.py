"""All experiments, from the rounds to the page."""

from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import divespot
from divespot.errors import unwritable
from divespot.plot import figure_class
from divespot.report import finite
from divespot.reproduce import (
    ablation,
    compression,
    from_frames,
    grounds,
    growth,
    methods,
    plateaus,
    running,
    shapes,
)
from divespot.reproduce.charts import draw
from divespot.reproduce.found import Found, merged
from divespot.reproduce.html import html
from divespot.reproduce.page import counted, page
from divespot.reproduce.plan import Plan
from divespot.volume.geometry import spatial

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from divespot.reproduce.experiment import Experiment
    from divespot.reproduce.found import Round
    from divespot.reproduce.page import Section

SCHEMA = "divespot.reproduction/1"
TITLE = "The evaluation of DIVESPOT, reproduced"
EXPERIMENTS = (
    shapes.EXPERIMENT,
    compression.EXPERIMENT,
    ablation.EXPERIMENT,
    methods.EXPERIMENT,
    grounds.EXPERIMENT,
    growth.EXPERIMENT,
)
"""The experiments in the order of the page; the running times come last."""
FROM_FRAMES = (from_frames.EXPERIMENT, plateaus.EXPERIMENT)
"""The experiments that register depth frames, which come before the running times."""


def experiments(plan: Plan) -> tuple[Experiment, ...]:
    """Return the experiments of a plan."""
    return (*EXPERIMENTS, *FROM_FRAMES) if plan.frames else EXPERIMENTS


def reproduce(
    out: str | os.PathLike[str],
    plan: Plan | None = None,
    *,
    jobs: int = 1,
    on_round: Callable[[int, int], None] | None = None,
) -> Path:
    """Run every experiment of the paper and write the page.

    Parameters
    ----------
    out
        Folder for ``reproduce.md``, ``reproduce.html``, ``figures/``, ``reproduce.json``,
        ``times.json`` and the finished rounds, which are not repeated.
    plan
        The extent: by default everything, ``Plan.quick()`` for a few minutes. The same plan gives
        the same files, except for the measured times.
    jobs
        Number of processes (see `divespot.evaluate.run_rounds`).
    on_round
        Called with the number of finished rounds and the number of all rounds.

    Returns
    -------
    page
        Path of ``reproduce.md``.

    Raises
    ------
    DivespotError
        An extra is not installed, or the folder cannot be used.

    """
    plan = plan or Plan()
    # Missing extras are reported before hours of work.
    spatial(), figure_class(), html("", "")
    side, alone = _rounds(plan), list(running.rounds(plan))
    done = itertools.count(1)

    def tell() -> None:
        if on_round is not None:
            on_round(next(done), len(side) + len(alone))

    found = Found.by(side, jobs=jobs, folder=out, on_done=tell)
    sections = {one.name: one.section(found, plan) for one in experiments(plan)}
    # Times are measured when nothing else runs.
    times = running.section(Found.by(alone, folder=out, on_done=tell), plan)
    return _write(Path(out), plan, sections, times)


def _rounds(plan: Plan) -> list[Round]:
    """Return all rounds that may run in parallel, the longest first."""
    needs = merged(need for one in experiments(plan) for need in one.needs(plan))
    needs.sort(key=lambda one: -len(one.variants))
    return [*(r for one in experiments(plan) for r in one.rounds(plan)), *needs]


def _write(out: Path, plan: Plan, sections: dict[str, Section], times: Section) -> Path:
    text = page(TITLE, _introduction(plan), [*sections.values(), times])
    described = {
        "schema": SCHEMA,
        "divespot": divespot.__version__,
        "plan": dataclasses.asdict(plan),
        "experiments": {name: _described(section) for name, section in sections.items()},
    }
    files = {
        "reproduce.md": text,
        "reproduce.html": html(TITLE, text),
        "reproduce.json": _json(described),
        "times.json": _json(_described(times)),
    }
    try:
        for name, content in files.items():
            (out / name).write_text(content, encoding="utf-8")
        for picture in (p for section in (*sections.values(), times) for p in section.pictures()):
            draw(picture.chart, out / picture.path)
    except OSError as error:
        raise unwritable(out, error) from None
    return out / "reproduce.md"


def _described(section: Section) -> dict[str, Any]:
    findings = [dataclasses.asdict(finding) for finding in section.findings]
    return {**section.data, "findings": findings}


def _json(value: dict[str, Any]) -> str:
    return json.dumps(finite(value), indent=1, allow_nan=False) + "\n"


def _introduction(plan: Plan) -> str:
    densities = (
        ""
        if plan.density == plan.side_density == 1.0
        else (
            f" The shapes, their compression and the ablation use {plan.density:.0%} of the "
            f"full number of points, the comparison of methods and of grounds "
            f"{plan.side_density:.0%}."
        )
    )
    return (
        f"Written by `divespot reproduce` of divespot {divespot.__version__}, seed {plan.seed}: "
        f"{counted(plan.rounds, 'scan')} of each shape, "
        f"{plan.side_rounds} in the other experiments."
        f"{densities} The paper is *DIVESPOT: Depth Integrated Volume Estimation of Pile of "
        "Things Based on Point Cloud*; its scans were never published, so all scans here are "
        "simulated, of piles whose volume is known exactly: a time-of-flight camera on a rail "
        "above corn, with noise, registration errors, flying pixels, outliers, posts, boxes "
        "and people (`divespot.simulate`). Columns named after the paper quote it; `Settings()` "
        "is divespot as it is used, `Settings.paper()` the paper's method. Errors are mean "
        "absolute relative errors unless they carry a sign. A pile that is not found counts as "
        "an error of 100 %."
    )
