"""What the command line can ask for; standard library only, so that it answers at once."""

from __future__ import annotations

import argparse
from pathlib import Path

KERNELS = ("radius", "hdbscan", "voxel", "plane", "pipeline")
SIZES = (30_000, 100_000, 300_000, 1_000_000)
QUICK_SIZES = (30_000, 100_000)
#: The pipeline is also run on a common scan, and on one ten times as large.
PIPELINE_SIZES = (400_000, 4_000_000)


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="rivals", description="Compare divespot with its rivals.")
    parser.add_argument("--quick", action="store_true", help="30k and 100k points, 3 runs each")
    parser.add_argument("--sizes", type=numbers, help="points, such as 30000,300000")
    parser.add_argument("--only", type=kernels, default=KERNELS, help=", ".join(KERNELS))
    parser.add_argument("--out", type=Path, help="write the tables into this Markdown file")
    options = parser.parse_args()
    options.repeats = 3 if options.quick else 5
    options.pipeline_sizes = () if options.quick or options.sizes else PIPELINE_SIZES
    options.sizes = options.sizes or (QUICK_SIZES if options.quick else SIZES)
    return options


def numbers(text: str) -> tuple[int, ...]:
    """Read whole numbers between commas."""
    sizes = tuple(sorted(int(part) for part in text.split(",")))
    if sizes[0] < 10_000:
        raise argparse.ArgumentTypeError(f"{sizes[0]} points given: 10000 or more are needed")
    return sizes


def kernels(text: str) -> tuple[str, ...]:
    """Read names of kernels between commas."""
    names = tuple(text.split(","))
    for name in names:
        if name not in KERNELS:
            raise argparse.ArgumentTypeError(f"{name!r} given: some of {KERNELS} are needed")
    return names
