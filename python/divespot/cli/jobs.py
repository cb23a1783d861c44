"""The option for the number of processes that simulate and measure."""

import os

import click

jobs_option = click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=lambda: os.cpu_count() or 1,
    show_default="processors",
    help="processes that simulate and measure",
)
