"""Output files of commands: checked before anything is measured, then written whole or not."""

from __future__ import annotations

import json
import os
import sys
from typing import TYPE_CHECKING, Any, TypeVar

import click

from divespot.errors import DivespotError
from divespot.output import append_line, refuse_inputs, require_own, write_text
from divespot.results.csv_rows import failed_row, now, rows_of, write_rows

if TYPE_CHECKING:
    import re
    from collections.abc import Callable, Iterable, Mapping

    from divespot.errors import Status
    from divespot.report import Report

F = TypeVar("F", bound="Callable[..., Any]")

ERROR_SCHEMA = "divespot.error/1"

#: The path that means the standard output.
STDOUT = "-"

force_option = click.option(
    "--force", is_flag=True, help="overwrite files that divespot did not write; never a SCAN"
)


def json_option(help_text: str, metavar: str = "PATH|-") -> Callable[[F], F]:
    """Return the option ``--json``, where - means the standard output."""
    path = click.Path(allow_dash=True)
    return click.option("--json", "json_file", type=path, metavar=metavar, help=help_text)


def points_option(*, required: bool) -> Callable[[F], F]:
    """Return the option ``--output`` of a command that writes points."""
    return click.option(
        "--output",
        "-o",
        required=required,
        type=click.Path(),
        metavar="PATH",
        help="file for the points: .ply, .npy, .xyz, .las or .laz",
    )


def ends_in(endings: tuple[str, ...]) -> Callable[[Any, Any, str | None], str | None]:
    """Return a callback that refuses a path with another ending before anything is done."""

    def checked(_ctx: click.Context, _param: click.Parameter, path: str | None) -> str | None:
        if path is not None and endings and not path.lower().endswith(endings):
            raise click.BadParameter(
                f"{path!r}: one of {', '.join(endings)} is needed as its ending"
            )
        return path

    return checked


def check_outputs(
    outputs: Mapping[str, tuple[str | None, re.Pattern[bytes]]],
    inputs: Iterable[str | None],
    *,
    force: bool,
) -> None:
    """Refuse outputs that would overwrite an input, another output, or another program's file.

    Parameters
    ----------
    outputs
        For each option its path, if given, and how such files begin.
    inputs
        Paths of all inputs.
    force
        Overwrite other programs' files.

    """
    read = list(inputs)
    for option, (path, kind) in outputs.items():
        if path is None or path == STDOUT:
            continue
        refuse_inputs(path, option, read)
        require_own(path, kind, option, force=force)
        read.append(path)


class JsonLines:
    """JSON Lines on the standard output or in a file, one line per call.

    The first line replaces the file's content, unless lines are appended; if the process ends
    early, all lines in the file are complete.
    """

    def __init__(self, path: str, *, append: bool) -> None:
        self._path = path
        self._append = append

    def write(self, value: Mapping[str, Any]) -> None:
        """Write a value as one line, with the time as its first field."""
        line = json.dumps({"time": now(), **value}, allow_nan=False) + "\n"
        if self._path == STDOUT:
            _print(line)
        elif self._append:
            append_line(self._path, line)
        else:
            write_text(self._path, line)
            self._append = True


class CsvRows:
    """Rows of a CSV file; the first replaces the file's content, unless rows are appended."""

    def __init__(self, path: str, *, append: bool) -> None:
        self._path = path
        self._append = append

    def write(self, report: Report) -> None:
        """Write a row for each pile."""
        self._write(rows_of(report))

    def fail(self, scan: str, sentence: str) -> None:
        """Write that a scan could not be measured."""
        self._write([failed_row(scan, sentence)])

    def _write(self, rows: list[dict[str, Any]]) -> None:
        write_rows(self._path, rows, append=self._append)
        self._append = True


def write_json(path: str, text: str) -> None:
    """Write one JSON value to a file or to the standard output."""
    if path == STDOUT:
        _print(text + "\n")
    else:
        write_text(path, text + "\n")


def _print(text: str) -> None:
    if sys.stdout is None:
        raise DivespotError("the standard output is closed: an open one, or a file, is needed")
    click.echo(text, nl=False)


def failed(scan: str, sentence: str, status: Status) -> dict[str, Any]:
    """Return the JSON line for a scan that could not be measured."""
    path = os.fsencode(scan).decode("utf-8", "replace")
    source = {"path": path}
    return {"schema": ERROR_SCHEMA, "status": status, "source": source, "error": sentence}
