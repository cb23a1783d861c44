"""``divespot measure``: scans in, piles out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from divespot.base_name import BaseName
from divespot.cli.failure import Failure, said
from divespot.cli.options import Grouped, chosen_settings, setting_options
from divespot.cli.outputs import (
    STDOUT,
    JsonLines,
    check_outputs,
    failed,
    force_option,
    write_json,
)
from divespot.cli.screen import file_name, progress_line, stdout_console, tell
from divespot.errors import DivespotError, printable
from divespot.output import OUTLINES, PICTURE, POINTS, REPORT
from divespot.report import finite

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


@click.command(cls=Grouped)
@click.argument("scans", metavar="SCAN...", type=click.Path(), nargs=-1, required=True)
@setting_options
@click.option(
    "--json",
    "json_file",
    type=click.Path(allow_dash=True),
    metavar="PATH|-",
    help="write the report as JSON, - for stdout and nothing else there; of several scans, one "
    "line each with its time (JSON Lines), also of those that cannot be measured",
)
@click.option("--append", is_flag=True, help="add a line to the file of --json, of one scan too")
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
@force_option
@click.pass_context
def measure(
    ctx: click.Context,
    /,
    scans: tuple[str, ...],
    json_file: str | None,
    append: bool,  # noqa: FBT001 - click's call
    force: bool,  # noqa: FBT001 - as above
    **_others: Any,  # noqa: ANN401 - as many types as settings; read from the context
) -> None:
    """Measure every pile in each SCAN.

    SCAN is a PLY, PCD, LAS, LAZ, XYZ, CSV, TXT, NPY or NPZ file, or one of them in a GZIP or ZIP
    file. No option is needed: every length that is not given is derived from the scan's own point
    spacing. A scan that cannot be measured is named on stderr, and the next one is measured.
    """
    settings = chosen_settings(ctx)
    files = {name: path for name in FILES if (path := ctx.params[name]) is not None}
    if len(scans) > 1 and files:
        option = "--" + next(iter(files)).replace("_", "-")
        raise click.UsageError(f"{option} needs one SCAN, {len(scans)} were given", ctx)
    if append and json_file is None:
        raise click.UsageError("--append needs --json", ctx)
    _check(scans, settings, json_file, files, force=force)
    lines = JsonLines(json_file, append=append) if json_file and (append or scans[1:]) else None
    output = Output(json_file, lines, files)
    good = [_measure_one(scan, settings, output) for scan in scans]
    if not all(good):
        ctx.exit(1)


def _check(
    scans: tuple[str, ...],
    settings: Settings,
    json_file: str | None,
    files: Mapping[str, str],
    *,
    force: bool,
) -> None:
    """Refuse outputs over what is read or is not our own."""
    outputs = {
        "--json": (json_file, REPORT),
        "--picture": (files.get("picture"), PICTURE),
        "--save-base": (files.get("save_base"), POINTS),
        "--save-outlines": (files.get("save_outlines"), OUTLINES),
    }
    base = BaseName.parse(settings.base)
    outline = settings.outline if isinstance(settings.outline, str) else None
    read = (*scans, outline, (base.path or None) if base else None)
    check_outputs(outputs, read, force=force)


@dataclass(frozen=True)
class Output:
    """Where reports go."""

    json_file: str | None
    lines: JsonLines | None
    files: Mapping[str, str]

    def write(self, report: Report) -> bool:
        """Write a report to all places that were asked for, pictures last.

        Returns whether all could be written; one that cannot does not cost the others.
        """
        steps: list[Callable[[], None]] = []
        if self.lines is not None:
            steps.append(partial(self.lines.write, finite(report.to_dict())))
        elif self.json_file is not None:
            steps.append(partial(write_json, self.json_file, report.to_json()))
        steps += [partial(_save, name, report, path) for name, path in self._ordered()]
        if self.json_file != STDOUT:
            steps.insert(len(steps) - ("picture" in self.files), partial(show, report))
        failures = [error for step in steps if (error := _attempt(step)) is not None]
        for error in failures:
            if isinstance(error, BrokenPipeError):
                raise error  # click ends quietly: nobody reads any more
            Failure(said(error)).show()
        return not failures

    def fail(self, scan: str, sentence: str) -> None:
        """Write that a scan could not be measured."""
        if self.lines is not None:
            error = _attempt(partial(self.lines.write, failed(scan, sentence)))
            if error is not None:
                Failure(said(error)).show()

    def _ordered(self) -> list[tuple[str, str]]:
        return sorted(self.files.items(), key=lambda item: item[0] == "picture")


def _attempt(step: Callable[[], None]) -> DivespotError | OSError | None:
    """Write one output; return what went wrong."""
    try:
        step()
    except (DivespotError, OSError) as error:
        return error
    return None


def _save(name: str, report: Report, path: str) -> None:
    if name == "picture":
        _draw(report, path)
        return
    from divespot import save_base, save_outlines  # noqa: PLC0415 - slow to import

    save = save_base if name == "save_base" else save_outlines
    save(report, path)


def _draw(report: Report, path: str) -> None:
    from divespot.plot import save_picture  # noqa: PLC0415 - needs the plot extra

    try:
        save_picture(report, path)
    except DivespotError:
        raise
    # What matplotlib does not manage costs the picture alone.
    except Exception as error:  # noqa: BLE001
        raise DivespotError(f"{path}: cannot be drawn ({type(error).__name__}: {error})") from None


def _measure_one(scan: str, settings: Settings, output: Output) -> bool:
    """Measure one scan and tell of it; return whether that worked."""
    try:
        report = run(scan, settings)
    except (DivespotError, MemoryError) as error:
        sentence = _named(scan, str(error) or "there is too little memory for this scan")
        Failure(sentence).show()
        output.fail(scan, sentence)
        return False
    show_warnings(report)
    return output.write(report)


def run(scan: str | Path, settings: Settings) -> Report:
    """Measure a file with a progress line."""
    from divespot.pipeline import measure as pipeline  # noqa: PLC0415 - slow to import

    name = printable(click.format_filename(scan, shorten=True))
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
        tell(f"divespot: {_file_name(report)}: warning: {printable(warning)}")


def _file_name(report: Report) -> str:
    return file_name(report.source.path or "points")


def _named(scan: str, sentence: str) -> str:
    name = file_name(scan)
    return sentence if sentence.startswith(name) else f"{name}: {sentence}"
