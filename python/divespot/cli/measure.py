"""``divespot measure``: scans in, piles out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Any

import click

from divespot.cli.failure import Failure
from divespot.cli.options import chosen_settings, setting_options
from divespot.cli.screen import progress_line, stdout_console
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from divespot.report import Report
    from divespot.settings import Settings


#: Options that name files which belong to one scan.
FILES = ("picture", "save_base", "save_outlines")


def png_only(_ctx: click.Context, _param: click.Parameter, value: str | None) -> str | None:
    """Refuse a picture that is no PNG before anything is measured."""
    if value is not None and not value.lower().endswith(".png"):
        raise click.BadParameter(f"{value!r} does not end in .png")
    return value


@click.command()
@click.argument("scans", metavar="SCAN...", type=click.Path(), nargs=-1, required=True)
@setting_options
@click.option(
    "--json",
    "json_file",
    type=click.File("w", encoding="utf-8", lazy=True),
    metavar="PATH|-",
    help="write the report as JSON, - for stdout and nothing else there; of several scans, one "
    "line each (JSON Lines)",
)
@click.option(
    "--picture",
    type=click.Path(),
    metavar="PATH.png",
    callback=png_only,
    help="draw the height map with outlines and the height histogram (one scan only)",
)
@click.option(
    "--save-base",
    type=click.Path(),
    metavar="PATH",
    help="write the base in force as .ply, .npy or .xyz, for --base surface=PATH (one scan only)",
)
@click.option(
    "--save-outlines",
    type=click.Path(),
    metavar="PATH",
    help="write the piles' outlines as GeoJSON, for --outline PATH (one scan only)",
)
@click.pass_context
def measure(
    ctx: click.Context,
    /,
    scans: tuple[str, ...],
    json_file: IO[str] | None,
    **_others: Any,  # noqa: ANN401 - as many types as settings; read from the context
) -> None:
    """Measure every pile in each SCAN.

    SCAN is a PLY, PCD, LAS, LAZ, XYZ, CSV, TXT, NPY or NPZ file. No option is needed: every
    length that is not given is derived from the scan's own point spacing. A scan that cannot be
    measured is named on stderr, and the next one is measured.
    """
    settings = chosen_settings(ctx)
    files = {name: path for name in FILES if (path := ctx.params[name]) is not None}
    if len(scans) > 1 and files:
        option = "--" + next(iter(files)).replace("_", "-")
        raise click.UsageError(f"{option} needs one SCAN, {len(scans)} were given", ctx)
    output = Output(json_file, files, indent=1 if len(scans) == 1 else None)
    good = [_measure_one(scan, settings, output) for scan in scans]
    if not all(good):
        ctx.exit(1)


@dataclass(frozen=True)
class Output:
    """Where reports go."""

    json_file: IO[str] | None
    files: Mapping[str, str]
    indent: int | None

    def write(self, report: Report) -> None:
        """Write one report to all places that were asked for."""
        for name, path in self.files.items():
            _writer(name)(report, path)
        if self.json_file is not None:
            click.echo(report.to_json(indent=self.indent), file=self.json_file)
        if self.json_file is None or self.json_file.name != "-":
            show(report)


def _writer(name: str) -> Callable[[Report, str], None]:
    if name == "picture":
        from divespot.plot import save_picture  # noqa: PLC0415 - needs the plot extra

        return save_picture
    from divespot import save_base, save_outlines  # noqa: PLC0415 - slow to import

    return save_base if name == "save_base" else save_outlines


def _measure_one(scan: str, settings: Settings, output: Output) -> bool:
    """Measure one scan and tell of it; return whether that worked."""
    try:
        report = run(scan, settings)
    except DivespotError as error:
        Failure(_named(scan, str(error))).show()
        return False
    show_warnings(report)
    output.write(report)
    return True


def run(scan: str | Path, settings: Settings) -> Report:
    """Measure a file with a progress line."""
    from divespot.pipeline import measure as pipeline  # noqa: PLC0415 - slow to import

    name = click.format_filename(scan, shorten=True)
    with progress_line(f"measuring {name}") as on_stage:
        return pipeline(scan, settings, on_stage=on_stage)


def show(report: Report) -> None:
    """Print a report for people."""
    from divespot.cli.tables import bases_table, report_table  # noqa: PLC0415 - slow to import

    seconds = sum(report.timings_s.values())
    click.echo(f"{_file_name(report)}: {report.source.points:,} points in {seconds:.2f} s\n")
    if report.piles or report.other_objects:
        stdout_console().print(report_table(report))
        if report.settings.compare_bases and report.piles:
            click.echo()
            stdout_console().print(bases_table(report))
    else:
        click.echo("  no object stands on the ground\n")


def show_warnings(report: Report) -> None:
    """Print what a user should know before trusting the numbers, on stderr."""
    for warning in report.warnings:
        click.echo(f"divespot: {_file_name(report)}: warning: {warning}", err=True)


def _file_name(report: Report) -> str:
    return click.format_filename(report.source.path or "points")


def _named(scan: str, sentence: str) -> str:
    name = click.format_filename(scan)
    return sentence if sentence.startswith(name) else f"{name}: {sentence}"
