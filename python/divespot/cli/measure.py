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
    CsvRows,
    JsonLines,
    check_outputs,
    failed,
    force_option,
    write_json,
)
from divespot.cli.results import chosen_files, result_options
from divespot.cli.screen import file_name, loudness_options, progress_line, stdout_console, tell
from divespot.errors import DivespotError, printable
from divespot.output import HISTORY, REPORT, TABLE
from divespot.report import finite
from divespot.results.csv_rows import now
from divespot.results.show_units import NAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

    from divespot.cli.results import ResultFile
    from divespot.report import Report
    from divespot.results.document import Survey
    from divespot.settings import Settings


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
@click.option(
    "--csv",
    "csv_file",
    type=click.Path(),
    metavar="PATH",
    help="write a row a pile as CSV, with the time; one too of a scan without piles, or one that "
    "cannot be measured",
)
@click.option(
    "--history",
    type=click.Path(),
    metavar="PATH.db",
    help="add to a history (SQLite), which `divespot history` lists and plots; --report shows it",
)
@click.option("--site", default="", help="name of the place, for --report and --history")
@click.option(
    "--append", is_flag=True, help="add to the files of --json and --csv, of one scan too"
)
@click.option(
    "--show-unit",
    type=click.Choice(NAMES),
    help="unit of the table's volumes; t: tonnes, which need a density  [default: m3, or L of "
    "small piles]",
)
@result_options
@loudness_options
@force_option
@click.pass_context
def measure(
    ctx: click.Context,
    /,
    scans: tuple[str, ...],
    **_others: Any,  # noqa: ANN401 - as many types as options; read from the context
) -> None:
    """Measure every pile in each SCAN.

    SCAN is a PLY, PCD, LAS, LAZ, XYZ, CSV, TXT, NPY or NPZ file, or one of them in a GZIP or ZIP
    file. No option is needed: every length that is not given is derived from the scan's own point
    spacing. A scan that cannot be measured is named on stderr, and the next one is measured.
    """
    settings = chosen_settings(ctx)
    files = chosen_files(ctx.params)
    _check_usage(ctx, settings, files)
    _check(ctx.params, settings, files)
    output = Output.of(ctx.params, files)
    good = [_measure_one(scan, settings, output) for scan in scans]
    if not all(good):
        ctx.exit(1)


def _check_usage(ctx: click.Context, settings: Settings, files: Mapping[ResultFile, str]) -> None:
    """Refuse options that do not go together."""
    given = ctx.params
    if len(given["scans"]) > 1 and files:
        option, count = next(iter(files)).flags[0], len(given["scans"])
        raise click.UsageError(f"{option} needs one SCAN, {count} were given", ctx)
    if given["append"] and given["json_file"] is None and given["csv_file"] is None:
        raise click.UsageError("--append needs --json or --csv", ctx)
    if given["show_unit"] == "t" and settings.density_kg_m3 is None and settings.material is None:
        raise click.UsageError("--show-unit t needs --material or --density", ctx)


def _check(given: Mapping[str, Any], settings: Settings, files: Mapping[ResultFile, str]) -> None:
    """Refuse outputs over what is read or is not our own."""
    outputs = {
        "--json": (given["json_file"], REPORT),
        "--csv": (given["csv_file"], TABLE),
        "--history": (given["history"], HISTORY),
        **{item.flags[0]: (path, item.own) for item, path in files.items()},
    }
    base = BaseName.parse(settings.base)
    outline = settings.outline if isinstance(settings.outline, str) else None
    read = (*given["scans"], outline, (base.path or None) if base else None)
    check_outputs(outputs, read, force=given["force"])


@dataclass(frozen=True)
class Output:
    """Where reports go."""

    json_file: str | None
    lines: JsonLines | None
    rows: CsvRows | None
    files: Mapping[ResultFile, str]
    show_unit: str | None
    quiet: bool
    history: str | None
    site: str

    @classmethod
    def of(cls, given: Mapping[str, Any], files: Mapping[ResultFile, str]) -> Output:
        """Return where the options say."""
        json_file, csv_file, append = given["json_file"], given["csv_file"], given["append"]
        several = append or given["scans"][1:]
        lines = JsonLines(json_file, append=append) if json_file and several else None
        rows = None if csv_file is None else CsvRows(csv_file, append=append)
        plain = ("show_unit", "quiet", "history", "site")
        return cls(json_file, lines, rows, files, **{name: given[name] for name in plain})

    def write(self, report: Report) -> bool:
        """Write a report to all places that were asked for, pictures last.

        Returns whether all could be written; one that cannot does not cost the others.
        """
        steps: list[Callable[[], None]] = []
        if self.lines is not None:
            steps.append(partial(self.lines.write, finite(report.to_dict())))
        elif self.json_file is not None:
            steps.append(partial(write_json, self.json_file, report.to_json()))
        if self.rows is not None:
            steps.append(partial(self.rows.write, report))
        survey = self._survey()
        if self.history is not None:
            steps.append(partial(self._remember, report, survey))
        drawn = sum(item.is_drawn for item in self.files)
        steps += [partial(item.write, report, path, survey) for item, path in self.files.items()]
        if self.json_file != STDOUT and not self.quiet:
            steps.insert(len(steps) - drawn, partial(show, report, self.show_unit))
        return _all_done(steps)

    def _survey(self) -> Survey:
        """Return what is known of the place, before this measurement is added."""
        from divespot.results.document import Survey  # noqa: PLC0415 - slow to import
        from divespot.results.history import past  # noqa: PLC0415 - as above

        before = () if self.history is None else past(self.history, self.site)
        return Survey(self.site or None, now(), before)

    def _remember(self, report: Report, survey: Survey) -> None:
        from divespot.results.history import add  # noqa: PLC0415 - slow to import

        add(report, str(self.history), site=self.site, time=survey.date)

    def fail(self, scan: str, sentence: str) -> None:
        """Write that a scan could not be measured."""
        steps: list[Callable[[], None]] = []
        if self.lines is not None:
            steps.append(partial(self.lines.write, failed(scan, sentence)))
        if self.rows is not None:
            steps.append(partial(self.rows.fail, scan, sentence))
        _all_done(steps)


def _all_done(steps: Iterable[Callable[[], None]]) -> bool:
    """Take every step, and tell of those that fail."""
    failures = [error for step in steps if (error := _attempt(step)) is not None]
    for error in failures:
        if isinstance(error, BrokenPipeError):
            raise error  # click ends quietly: nobody reads any more
        Failure(said(error)).show()
    return not failures


def _attempt(step: Callable[[], None]) -> DivespotError | OSError | None:
    """Write one output; return what went wrong."""
    try:
        step()
    except (DivespotError, OSError) as error:
        return error
    return None


def _measure_one(scan: str, settings: Settings, output: Output) -> bool:
    """Measure one scan and tell of it; return whether that worked."""
    try:
        report = run(scan, settings)
    except (DivespotError, MemoryError) as error:
        sentence = _named(scan, str(error) or "there is too little memory for this scan")
        Failure(sentence).show()
        output.fail(scan, sentence)
        return False
    if not output.quiet:
        show_warnings(report)
    return output.write(report)


def run(scan: str | Path, settings: Settings) -> Report:
    """Measure a file with a progress line."""
    from divespot.pipeline import measure as pipeline  # noqa: PLC0415 - slow to import

    name = printable(click.format_filename(scan, shorten=True))
    with progress_line(f"measuring {name}") as on_stage:
        return pipeline(scan, settings, on_stage=on_stage)


def show(report: Report, unit: str | None = None) -> None:
    """Print a report for people."""
    from divespot.cli.tables import bases_table, report_table  # noqa: PLC0415 - slow to import

    seconds = sum(report.timings_s.values())
    click.echo(f"{_file_name(report)}: {report.source.points:,} points in {seconds:.2f} s\n")
    if report.piles or report.other_objects:
        stdout_console().print(report_table(report, unit))
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
