"""``divespot reproduce``: the paper's evaluation on one page."""

from __future__ import annotations

import click

from divespot.cli.jobs import jobs_option
from divespot.cli.screen import file_name, progress_bar


@click.command()
@click.option("--quick", is_flag=True, help="3 scans of each shape instead of 50, for a first look")
@click.option(
    "--frames",
    is_flag=True,
    help="also simulate the shapes as depth frames, and show each step of the registration",
)
@click.option(
    "--out",
    type=click.Path(file_okay=False),
    metavar="DIR",
    default="reproduction",
    show_default=True,
    help="folder for the page, its figures and JSON, and finished rounds: an interrupted run "
    "continues from there",
)
@jobs_option
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="seed of all random draws; the same seed gives the same page, except for measured times",
)
def reproduce(quick: bool, frames: bool, out: str, jobs: int, seed: int) -> None:  # noqa: FBT001 - click's call
    """Run the paper's experiments on simulated scans of known volume.

    Writes reproduce.md and reproduce.html, which show each of the paper's tables beside the
    measured one, figures, and the JSON behind them. Needs the extra divespot[reproduce].
    """
    from divespot.reproduce import Plan  # noqa: PLC0415 - slow to import
    from divespot.reproduce import reproduce as run  # noqa: PLC0415 - as above

    plan = Plan.quick(seed, frames=frames) if quick else Plan(seed=seed, frames=frames)
    with progress_bar("reproducing") as on_round:
        page = run(out, plan, jobs=jobs, on_round=on_round)
    click.echo(f"written: {file_name(page)}")
