"""Run the contest and print its tables; `rivals.py` sets up what this needs."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from contest import checks, clouds, goals, table
from contest.match import play
from contest.options import parse

if TYPE_CHECKING:
    import argparse
    from collections.abc import Iterator

    from contest.match import Outcome

INTRODUCTION = """# divespot and its rivals

Printed by `python benches/rivals.py`, all from one run, on simulated scans of the scene
shape-16. Programs run by turns, each in its own process with its input loaded and its code
compiled, with as many threads as it takes by itself or can be told to take; seconds are of the
best run. Peak memory is the first run's, above what the process held before, worker processes
that a program starts not counted.

Programs are told to do the same work and their answers are compared with divespot's. Every
HDBSCAN meets ties, since neighbours share distances: the programs settle them each in their own
way, and single points at the edge of a cluster differ between any two of them.
"""


def main() -> None:
    """Run what the command line asks for."""
    options = parse()
    lines = [INTRODUCTION, *table.machine(), ""]
    everything: list[Outcome] = []
    with tempfile.TemporaryDirectory() as folder:
        for outcomes in contests(options, Path(folder)):
            everything += outcomes
            lines += table.section(outcomes)
    lines += goals.table(everything)
    print("\n".join(lines))
    if options.out:
        options.out.write_text("\n".join(lines))


def contests(options: argparse.Namespace, folder: Path) -> Iterator[list[Outcome]]:
    """Yield the outcomes of each kernel over all sizes."""
    made: dict[int, clouds.Cloud] = {}
    for kernel in options.only:
        more = options.pipeline_sizes if kernel == "pipeline" else ()
        outcomes: list[Outcome] = []
        for count in sorted({*options.sizes, *more}):
            made[count] = made.get(count) or clouds.make(count, folder)
            sys.stderr.write(f"{kernel} {count:,} ...\n")
            latest = play(kernel, made[count], options.repeats, outcomes)
            checks.remark(latest, made[count])
            outcomes += latest
        yield outcomes


main()
