"""``divespot measure``: scans in, piles out."""

from __future__ import annotations

import json
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
from divespot.cli.screen import file_name, progress_line, tell
from divespot.errors import DivespotError, printable
from divespot.output import OUTLINES, PICTURE, POINTS, REPORT
from divespot.report import finite

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from divespot.errors import Status
    from divespot.report import Report
    from divespot.settings import Settings


#: A scan, or several that are one survey.
Survey = str | tuple[str, ...]

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
@click.option("--merge", is_flag=True, help="measure all SCANs as one survey: tiles, set-ups")
@click.option(
    "--json",
    "json_file",
    type=click.Path(allow_dash=True),
    metavar="PATH|-",
    help="write the report as JSON, - for stdout and nothing else there; of several scans, one "
    "line each with its time (JSON Lines), also of those that cannot be measured",
)
@click.option(
    "--status",
    is_flag=True,
    help="print one line a scan instead of the table, for scripts: status=measured, no_pile, "
    "no_ground, nothing_seen or bad_input, and what was measured",
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
def measure(  # noqa: PLR0913, PLR0917 - one argument an option
    ctx: click.Context,
    /,
    scans: tuple[str, ...],
    merge: bool,  # noqa: FBT001 - click's call
    json_file: str | None,
    append: bool,  # noqa: FBT001 - as above
    force: bool,  # noqa: FBT001 - as above
    **_others: Any,  # noqa: ANN401 - as many types as settings; read from the context
) -> None:
    """Measure every pile in each SCAN.

    SCAN is a PLY, PCD, LAS, LAZ, E57, PTX, XYZ, CSV, TXT, NPY or NPZ file, or one of them in a
    GZIP or ZIP file. No option is needed: every length that is not given is derived from the
    scan's own point spacing. A scan that cannot be measured is named on stderr, and the next
    one is measured.
    """
    settings = chosen_settings(ctx)
    files = {name: path for name in FILES if (path := ctx.params[name]) is not None}
    surveys: list[Survey] = [scans if len(scans) > 1 else scans[0]] if merge else list(scans)
    if len(surveys) > 1 and files:
        option = "--" + next(iter(files)).replace("_", "-")
        raise click.UsageError(
            f"{option} needs one SCAN, {len(scans)} were given (or --merge them)", ctx
        )
    if append and json_file is None:
        raise click.UsageError("--append needs --json", ctx)
    if ctx.params["status"] and json_file == STDOUT:
        raise click.UsageError("--status needs the standard output, which --json - takes", ctx)
    _check(scans, settings, json_file, files, force=force)
    lines = JsonLines(json_file, append=append) if json_file and (append or surveys[1:]) else None
    output = Output(json_file, lines, files, show_status if ctx.params["status"] else show)
    good = [_measure_one(survey, settings, output) for survey in surveys]
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
    show: Callable[[Report], None]

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
            steps.insert(len(steps) - ("picture" in self.files), partial(self.show, report))
        failures = [error for step in steps if (error := _attempt(step)) is not None]
        for error in failures:
            if isinstance(error, BrokenPipeError):
                raise error  # click ends quietly: nobody reads any more
            Failure(said(error)).show()
        return not failures

    def fail(self, scan: str, sentence: str, status: Status) -> None:
        """Write that a scan could not be measured."""
        if self.show is show_status:
            click.echo(_status_line(status, file_name(scan), error=_quoted(sentence)))
        if self.lines is not None:
            error = _attempt(partial(self.lines.write, failed(scan, sentence, status)))
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


def _measure_one(survey: Survey, settings: Settings, output: Output) -> bool:
    """Measure one scan, or several as one, and tell of it; return whether that worked."""
    scans = (survey,) if isinstance(survey, str) else survey
    try:
        report = run(survey, settings)
    except (DivespotError, MemoryError) as error:
        sentence = _named(scans, str(error) or "there is too little memory for this scan")
        Failure(sentence).show()
        status: Status = error.status if isinstance(error, DivespotError) else "bad_input"
        output.fail(scans[0], sentence, status)
        return False
    show_warnings(report)
    return output.write(report)


def run(survey: Survey | Path, settings: Settings) -> Report:
    """Measure a file, or several as one, with a progress line."""
    from divespot.pipeline import measure as pipeline  # noqa: PLC0415 - slow to import

    first = survey[0] if isinstance(survey, tuple) else survey
    name = printable(click.format_filename(first, shorten=True))
    with progress_line(f"measuring {name}") as on_stage:
        return pipeline(survey, settings, on_stage=on_stage)


def show(report: Report) -> None:
    """Print a report for people."""
    from divespot.cli.table import show_table  # noqa: PLC0415 - as below
    from divespot.cli.tables import bases_table, report_table  # noqa: PLC0415 - slow to import

    seconds = sum(report.timings_s.values())
    click.echo(f"{_file_name(report)}: {report.source.points:,} points in {seconds:.2f} s\n")
    if report.piles or report.other_objects:
        show_table(report_table(report))
        if report.settings.compare_bases and report.piles:
            click.echo()
            show_table(bases_table(report))
    else:
        click.echo("  no object stands on the ground\n")


def show_status(report: Report) -> None:
    """Print a report as one line of words for a script; the first tells what became of the scan."""
    total = report.total
    figures = {
        "piles": str(len(report.piles)),
        "volume_m3": f"{total.volume_m3:.6g}",
        "u95_m3": f"{total.u95_m3:.2g}",
    }
    click.echo(_status_line(report.status, _file_name(report), **figures))


def _status_line(status: Status, scan: str, **figures: str) -> str:
    words = {"status": status, **figures, "scan": _quoted(scan)}
    return " ".join(f"{name}={value}" for name, value in words.items())


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def show_warnings(report: Report) -> None:
    """Print what a user should know before trusting the numbers, on stderr."""
    for warning in report.warnings:
        tell(f"divespot: {_file_name(report)}: warning: {printable(warning)}")


def _file_name(report: Report) -> str:
    name = file_name(report.source.path or "points")
    more = len(report.source.files) - 1
    return f"{name} and {more} more" if more > 0 else name


def _named(scans: tuple[str, ...], sentence: str) -> str:
    names = [file_name(scan) for scan in scans]
    return sentence if sentence.startswith(tuple(names)) else f"{names[0]}: {sentence}"
