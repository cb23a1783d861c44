"""Printing a report for people, and for scripts."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import click

from divespot.cli.screen import file_name, tell
from divespot.errors import printable
from divespot.io.merge import named

if TYPE_CHECKING:
    from divespot.errors import Status
    from divespot.report import Report


def show(report: Report, unit: str | None = None) -> None:
    """Print a report for people."""
    from divespot.cli.table import show_table  # noqa: PLC0415 - slow to import
    from divespot.cli.tables import bases_table, report_table  # noqa: PLC0415 - as above

    seconds = sum(report.timings_s.values())
    click.echo(f"{_survey_name(report)}: {report.source.points:,} points in {seconds:.2f} s\n")
    if report.piles or report.other_objects:
        show_table(report_table(report, unit))
        if report.settings.compare_bases and report.piles:
            click.echo()
            show_table(bases_table(report))
    else:
        click.echo("  no object stands on the ground\n")


def show_warnings(report: Report) -> None:
    """Print what a user should know before trusting the numbers, on stderr."""
    for warning in report.warnings:
        tell(f"divespot: {_survey_name(report)}: warning: {printable(warning)}")


def show_status(report: Report) -> None:
    """Print a report as one line of words for a script; the first is the status."""
    total = report.total
    figures = {
        "piles": str(len(report.piles)),
        "volume_m3": f"{total.volume_m3:.6g}",
        "u95_m3": f"{total.u95_m3:.2g}",
    }
    click.echo(_status_line(report.status, _survey_name(report), **figures))


def show_failure(scan: str, sentence: str, status: Status) -> None:
    """Print the line of `show_status` for a scan that could not be measured."""
    click.echo(_status_line(status, file_name(scan), error=_quoted(sentence)))


def _status_line(status: Status, scan: str, **figures: str) -> str:
    words = {"status": status, **figures, "scan": _quoted(scan)}
    return " ".join(f"{name}={value}" for name, value in words.items())


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _survey_name(report: Report) -> str:
    files = report.source.files or (report.source.path or "points",)
    return named([file_name(path) for path in files])
