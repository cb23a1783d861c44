"""The command line.

Exit status: 0 measured (also when no pile was found), 1 bad input, 2 wrong usage, 130 Ctrl-C.
"""

from __future__ import annotations

import click

from divespot import __version__
from divespot.cli.compare import compare
from divespot.cli.demo import demo
from divespot.cli.evaluate import evaluate
from divespot.cli.failure import Guarded
from divespot.cli.fuse import fuse
from divespot.cli.history import history
from divespot.cli.info import info
from divespot.cli.materials import materials
from divespot.cli.measure import measure
from divespot.cli.reproduce import reproduce
from divespot.cli.simulate import simulate

__all__ = ["main"]


@click.group(cls=Guarded, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(
    __version__, "-V", "--version", prog_name="divespot", message="%(prog)s %(version)s"
)
def main() -> None:
    """Measure the volume of each pile in a point cloud, with its uncertainty."""


for of_scans in (measure, fuse, compare, history, info):
    main.add_command(of_scans)
for other in (simulate, demo, evaluate, reproduce, materials):
    main.add_command(other)
