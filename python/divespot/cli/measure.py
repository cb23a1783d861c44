"""``divespot measure``: scans in, piles out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from divespot.base_name import BaseName
from divespot.cli.cluster import Cluster, cluster_options
from divespot.cli.depth import DepthFrames, frame_options
from divespot.cli.failure import Failure, said
from divespot.cli.options import Grouped, chosen_settings, setting_options
from divespot.cli.outputs import (
    STDOUT,
    CsvRows,
    JsonLines,
    check_outputs,
    failed,
    force_option,
    json_option,
    write_json,
)
from divespot.cli.profile import profile_option
from divespot.cli.results import chosen_files, result_options
from divespot.cli.screen import file_name, loudness_options, progress_line
from divespot.cli.telling import show, show_failure, show_status, show_warnings
from divespot.errors import DivespotError, printable
from divespot.output import HISTORY, REPORT, TABLE
from divespot.report import finite
from divespot.results.csv_rows import now
from divespot.results.show_units import NAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from divespot.cli.results import ResultFile
    from divespot.errors import Status
    from divespot.report import Report
    from divespot.results.document import Survey
    from divespot.settings import Settings

#: Files that are measured as one survey.
Files: TypeAlias = tuple[str, ...]


@click.command(cls=Grouped)
@click.argument("scans", metavar="SCAN...", type=click.Path(), nargs=-1, required=True)
@profile_option
@setting_options
@frame_options
@cluster_options
@click.option("--merge", is_flag=True, help="measure all SCANs as one survey: tiles, set-ups")
@json_option(
    "write the report as JSON; -: to stdout, and nothing else there; for several scans, one line "
    "each with the time (JSON Lines), also for those that cannot be measured"
)
@click.option(
    "--csv",
    "csv_file",
    type=click.Path(),
    metavar="PATH",
    help="write one row per pile as CSV, with the time; also one row for a scan without piles or "
    "one that cannot be measured",
)
@click.option(
    "--history",
    type=click.Path(),
    metavar="PATH.db",
    help="add to a history (SQLite), which `divespot history` lists and plots; --report shows it",
)
@click.option("--site", default="", help="name of the site, for --report and --history")
@click.option(
    "--append", is_flag=True, help="add to the files of --json and --csv, also for one scan"
)
@click.option(
    "--show-unit",
    type=click.Choice(NAMES),
    help="unit of the table's volumes; t: tonnes, which need a density  [default: m3, or L for "
    "small piles]",
)
@click.option(
    "--status",
    is_flag=True,
    help="print one line per scan instead of the table, for scripts: status=measured, no_pile, "
    "no_ground, nothing_seen or bad_input, and the volume",
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

    SCAN is a PLY, PCD, LAS, LAZ, E57, PTX, XYZ, CSV, TXT, NPY or NPZ file, or one of them in a
    GZIP or ZIP file. No option is needed: every length that is not given is derived from the
    scan's own point spacing. If a scan cannot be measured, an error is printed on stderr and the
    next one is measured. With --intrinsics, SCAN is a folder (or an NPY or NPZ file) of depth
    frames, which are fused first; so is a recording (.bag, .mcap, .db3, .mkv).
    """
    settings = chosen_settings(ctx)
    depth = DepthFrames.of(ctx)
    files = chosen_files(ctx.params)
    cluster = Cluster.of(ctx)
    surveys = [scans] if cluster or ctx.params["merge"] else [(scan,) for scan in scans]
    _check_usage(ctx, settings, surveys, files)
    _check(ctx.params, settings, files, depth)
    output = Output.of(ctx.params, surveys, files)
    good = [_measure_one(survey, settings, output, depth, cluster) for survey in surveys]
    if not all(good):
        ctx.exit(1)


def _check_usage(
    ctx: click.Context,
    settings: Settings,
    surveys: Sequence[Files],
    files: Mapping[ResultFile, str],
) -> None:
    """Refuse options that exclude each other."""
    given = ctx.params
    if len(surveys) > 1 and files:
        option, count = next(iter(files)).flags[0], len(surveys)
        raise click.UsageError(
            f"{option} and {count} SCANs were given: one SCAN is needed, or --merge", ctx
        )
    if given["status"] and given["json_file"] == STDOUT:
        raise click.UsageError("--status and --json - were given: one of them is needed", ctx)
    if given["append"] and given["json_file"] is None and given["csv_file"] is None:
        raise click.UsageError("--append was given: --json or --csv is needed with it", ctx)
    sources = (settings.density_kg_m3, settings.material, settings.outline)
    if given["show_unit"] == "t" and all(source is None for source in sources):
        sentence = "--show-unit t was given: --material or --density is needed with it"
        raise click.UsageError(sentence, ctx)


def _check(
    given: Mapping[str, Any],
    settings: Settings,
    files: Mapping[ResultFile, str],
    depth: DepthFrames | None,
) -> None:
    """Refuse outputs that would overwrite inputs or files of other programs."""
    outputs = {
        "--json": (given["json_file"], REPORT),
        "--csv": (given["csv_file"], TABLE),
        "--history": (given["history"], HISTORY),
        **{item.flags[0]: (path, item.own) for item, path in files.items()},
    }
    base = BaseName.parse(settings.base)
    outline = settings.outline if isinstance(settings.outline, str) else None
    frames = depth.read() if depth else ()
    read = (
        *given["scans"],
        *frames,
        given["profile"],
        outline,
        (base.path or None) if base else None,
    )
    check_outputs(outputs, read, force=given["force"])


@dataclass(frozen=True)
class Output:
    """Where reports are written."""

    json_file: str | None
    lines: JsonLines | None
    rows: CsvRows | None
    files: Mapping[ResultFile, str]
    show_unit: str | None
    status: bool
    quiet: bool
    history: str | None
    site: str

    @classmethod
    def of(
        cls,
        given: Mapping[str, Any],
        surveys: Sequence[Files],
        files: Mapping[ResultFile, str],
    ) -> Output:
        """Return the outputs that the options name."""
        json_file, csv_file, append = given["json_file"], given["csv_file"], given["append"]
        several = append or surveys[1:]
        lines = JsonLines(json_file, append=append) if json_file and several else None
        rows = None if csv_file is None else CsvRows(csv_file, append=append)
        plain = ("show_unit", "status", "quiet", "history", "site")
        return cls(json_file, lines, rows, files, **{name: given[name] for name in plain})

    def write(self, report: Report) -> bool:
        """Write a report to all outputs, pictures last.

        Returns whether all were written; if one fails, the others are still written.
        """
        steps: list[Callable[[], None]] = []
        if self.lines is not None:
            steps.append(partial(self.lines.write, finite(report.to_dict())))
        elif self.json_file is not None:
            steps.append(partial(write_json, self.json_file, report.to_json()))
        if self.rows is not None:
            steps.append(partial(self.rows.write, report))
        survey = None
        if self.history is not None or any(item.is_page for item in self.files):
            survey = self._survey()
        if self.history is not None:
            steps.append(partial(self._remember, report, survey))
        drawn = sum(item.is_drawn for item in self.files)
        steps += [partial(item.write, report, path, survey) for item, path in self.files.items()]
        if (told := self._told(report)) is not None:
            steps.insert(len(steps) - drawn, told)
        return _all_done(steps)

    def _told(self, report: Report) -> Callable[[], None] | None:
        """Return the function that prints the report; ``--status`` prints even with ``--quiet``."""
        if self.status:
            return partial(show_status, report)
        is_silent = self.quiet or self.json_file == STDOUT
        return None if is_silent else partial(show, report, self.show_unit)

    def _survey(self) -> Survey:
        """Return earlier measurements of the site, before this one is added."""
        from divespot.results.document import Survey  # noqa: PLC0415 - slow to import
        from divespot.results.history import past  # noqa: PLC0415 - as above

        before = () if self.history is None else past(self.history, self.site)
        return Survey(self.site or None, now(), before)

    def _remember(self, report: Report, survey: Survey | None) -> None:
        from divespot.results.history import add  # noqa: PLC0415 - slow to import

        add(report, str(self.history), site=self.site, time=survey.date if survey else None)

    def fail(self, scan: str, sentence: str, status: Status) -> None:
        """Write that a scan could not be measured."""
        steps: list[Callable[[], None]] = []
        if self.status:
            steps.append(partial(show_failure, scan, sentence, status))
        if self.lines is not None:
            steps.append(partial(self.lines.write, failed(scan, sentence, status)))
        if self.rows is not None:
            steps.append(partial(self.rows.fail, scan, sentence))
        _all_done(steps)


def _all_done(steps: Iterable[Callable[[], None]]) -> bool:
    """Run every step, and report those that fail."""
    failures = [error for step in steps if (error := _attempt(step)) is not None]
    for error in failures:
        if isinstance(error, BrokenPipeError):
            raise error  # click exits quietly: the reader of stdout is gone
        Failure(said(error)).show()
    return not failures


def _attempt(step: Callable[[], None]) -> DivespotError | OSError | None:
    """Write one output; return the error, if any."""
    try:
        step()
    except (DivespotError, OSError) as error:
        return error
    return None


def _measure_one(
    survey: Files,
    settings: Settings,
    output: Output,
    depth: DepthFrames | None,
    cluster: Cluster | None,
) -> bool:
    """Measure one scan, or several as one, and report it; return whether that worked."""
    try:
        report = run(survey if survey[1:] else survey[0], settings, depth, cluster)
    except (DivespotError, MemoryError) as error:
        sentence = _named(survey, str(error) or "there is too little memory for this scan")
        Failure(sentence).show()
        status: Status = error.status if isinstance(error, DivespotError) else "bad_input"
        output.fail(survey[0], sentence, status)
        return False
    if not output.quiet:
        show_warnings(report)
    return output.write(report)


def run(
    survey: Files | str | Path,
    settings: Settings,
    depth: DepthFrames | None = None,
    cluster: Cluster | None = None,
) -> Report:
    """Measure a file, several as one, or depth frames, with a progress line."""
    from divespot import _native  # noqa: PLC0415 - slow to import
    from divespot.pipeline import measure as pipeline  # noqa: PLC0415 - as above

    _native.share_heap()
    first = survey[0] if isinstance(survey, tuple) else survey
    name = printable(click.format_filename(first, shorten=True))
    with progress_line(f"measuring {name}") as on_stage:
        if cluster is not None:
            files = survey if isinstance(survey, tuple) else (str(survey),)
            return cluster.measured(files, settings, on_stage)
        if depth is None or not depth.takes(str(first)):
            return pipeline(survey, settings, on_stage=on_stage)
        frames = depth.fused(survey, settings.threads, on_stage)  # type: ignore[arg-type]
        return pipeline(frames, settings, on_stage=on_stage)


def _named(survey: Files, sentence: str) -> str:
    names = tuple(map(file_name, survey))
    return sentence if sentence.startswith(names) else f"{names[0]}: {sentence}"
