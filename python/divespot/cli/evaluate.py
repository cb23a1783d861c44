"""``divespot evaluate``: the errors of the measurement on scans of known volume."""

from __future__ import annotations

import dataclasses
import json
import time
from typing import TYPE_CHECKING, Any

import click

from divespot.cli.jobs import jobs_option
from divespot.cli.outputs import STDOUT, check_outputs, force_option, json_option, write_json
from divespot.cli.screen import progress_bar
from divespot.output import REPORT

if TYPE_CHECKING:
    from divespot.evaluate import Evaluation

SCHEMA = "divespot.evaluation/1"


@click.command()
@click.option(
    "--scenes",
    metavar="NAMES",
    help="simulated scenes, separated by commas, with * as wildcard  [default: all, or none "
    "with --scans]",
)
@click.option(
    "--scans",
    type=click.Path(),
    metavar="LIST.csv",
    help="list of real scans: columns path and volume_m3, optionally unit; one row per pile",
)
@click.option(
    "--seeds",
    type=click.IntRange(min=1),
    default=5,
    show_default=True,
    help="scans of each scene; 4 times as many of randomly drawn scenes",
)
@click.option(
    "--first-seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="first seed of each scene; no constant was fitted on seeds of 4000 and above",
)
@click.option(
    "--density",
    type=float,
    default=1.0,
    show_default=True,
    help="number of points of each simulated scan, relative to the scene's own",
)
@click.option(
    "--paper",
    is_flag=True,
    help="also measure each simulated scan by the paper's method, and compare by kind",
)
@click.option(
    "--repeat",
    is_flag=True,
    help="measure each scan again with another seed, rounded, thinned by 1 % and with every point "
    "twice, and count the piles that change by less than a third of their u95",
)
@jobs_option
@click.option(
    "--out",
    type=click.Path(file_okay=False),
    metavar="DIR",
    help="folder where finished scans are kept: an interrupted run continues from there",
)
@json_option("write all results as JSON; -: to stdout, and nothing else there")
@force_option
def evaluate(  # noqa: PLR0913, PLR0917 - one argument an option
    scenes: str | None,
    scans: str | None,
    seeds: int,
    first_seed: int,
    density: float,
    paper: bool,  # noqa: FBT001 - click's call
    repeat: bool,  # noqa: FBT001 - click's call
    jobs: int,
    out: str | None,
    json_file: str | None,
    force: bool,  # noqa: FBT001 - click's call
) -> None:
    """Measure scans of known volume with the default settings, and report the errors.

    Prints one row per kind of scene, the errors of thinned scans beside the paper's, how often the
    truth lies within u95, and the figure reached for each goal. A pile that was not found counts
    as an error of 100 %; false piles are counted under remarks.
    """
    from divespot.evaluate import evaluate as run  # noqa: PLC0415 - slow to import
    from divespot.report import finite  # noqa: PLC0415 - as above

    check_outputs({"--json": (json_file, REPORT)}, (scans,), force=force)
    begin = time.monotonic()
    with progress_bar("evaluating") as on_round:
        evaluation = run(
            None if scenes is None else scenes.split(","),
            seeds=seeds,
            first_seed=first_seed,
            density=density,
            scans=scans,
            paper=paper,
            repeat=repeat,
            jobs=jobs,
            folder=out,
            on_round=on_round,
        )
    if json_file is not None:
        chosen = {"seeds": seeds, "first_seed": first_seed, "density": density}
        everything = finite({**described(evaluation), **chosen})
        write_json(json_file, json.dumps(everything, indent=1, allow_nan=False))
    if json_file != STDOUT:
        show(evaluation)
        click.echo(f"\n{_count(evaluation)} at density {density:g} in {_since(begin)}")


def described(evaluation: Evaluation) -> dict[str, Any]:
    """Return an evaluation for JSON: every outcome, a summary of each kind, the goals."""
    from divespot import __version__  # noqa: PLC0415 - the package imports this module
    from divespot.evaluate import goals  # noqa: PLC0415 - slow to import

    kinds = {kind: dataclasses.asdict(summary) for kind, summary in evaluation.summaries().items()}
    return {
        "schema": SCHEMA,
        "divespot": __version__,
        **dataclasses.asdict(evaluation),
        "kinds": kinds,
        "goals": [dataclasses.asdict(goal) for goal in goals(evaluation)],
    }


def show(evaluation: Evaluation) -> None:
    """Print an evaluation for people."""
    from divespot.cli import evaluation_tables as tables  # noqa: PLC0415 - slow to import
    from divespot.cli.table import show_table  # noqa: PLC0415 - as above

    for heading, table in tables.tables_of(evaluation):
        click.echo(f"\n{heading}\n")
        show_table(table)


def _count(evaluation: Evaluation) -> str:
    scans = len(evaluation.whole) + len(evaluation.real)
    seeds = sorted({one.seed for one in evaluation.whole if one.seed is not None})
    told = f", seeds {seeds[0]} to {seeds[-1]}," if seeds else ""
    return f"{scans} scans{told} and {len(evaluation.thinned)} thinned ones"


def _since(begin: float) -> str:
    seconds = round(time.monotonic() - begin)
    return f"{seconds // 60} min {seconds % 60} s"
