"""What a terminal shows."""

from __future__ import annotations

import io
import sys
import threading
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TypeVar

import click

from divespot.errors import printable
from divespot.log import NAME

if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator

    from rich.console import Console

F = TypeVar("F", bound="Callable[..., Any]")

#: Columns of text that goes into a file or a pipe, where no line is too long.
FILE_COLUMNS = 120

#: What takes no longer needs no progress line.
PATIENCE_S = 1.0


def stdout_console() -> Console:
    """Return a console that prints text as it is; file names are no markup."""
    from rich.console import Console  # noqa: PLC0415 - slow to import, --help does without

    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # not every terminal knows a ±
    width = None if sys.stdout is not None and sys.stdout.isatty() else FILE_COLUMNS
    return Console(markup=False, highlight=False, emoji=False, width=width)


def file_name(path: str | os.PathLike[str]) -> str:
    """Return a file's name as a terminal may show it."""
    return printable(click.format_filename(path))


def tell(line: str) -> None:
    """Print a line on stderr; where nobody can read it, go on without."""
    with suppress(OSError, ValueError):
        click.echo(line, err=True)


def loudness_options(command: F) -> F:
    """Add ``--verbose``, which logs on stderr, and ``--quiet``, which the command reads."""
    verbose = click.option(
        *("-v", "--verbose"),
        is_flag=True,
        expose_value=False,
        callback=_log,
        help="tell each stage with its time on stderr",
    )
    quiet = click.option(
        *("-q", "--quiet"), is_flag=True, help="print errors alone: no table, no warnings"
    )
    return verbose(quiet(command))


def _log(_ctx: click.Context, _param: click.Parameter, value: bool) -> None:  # noqa: FBT001 - click's call
    if not value:
        return
    import logging  # noqa: PLC0415 - for those who want it

    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter("divespot: %(message)s"))
    handler.addFilter(lambda record: record.levelno < logging.WARNING)  # those are printed anyway
    logger = logging.getLogger(NAME)
    logger.handlers = [handler]
    logger.setLevel(logging.INFO)


@contextmanager
def progress_line(task: str) -> Iterator[Callable[[str], None]]:
    """Show ``task: stage`` on stderr once `PATIENCE_S` have passed, on a terminal only.

    Yields
    ------
    on_stage
        To be called with the name of each stage as it begins.

    """
    if not _is_terminal():
        yield lambda _stage: None
        return
    from rich.console import Console  # noqa: PLC0415 - as above

    status = Console(stderr=True, markup=False).status(task)
    # A stage may itself take long, so time must run beside it.
    timer = threading.Timer(PATIENCE_S, status.start)
    timer.daemon = True
    timer.start()
    try:
        yield lambda stage: status.update(f"{task}: {stage}")
    finally:
        timer.cancel()
        timer.join()
        status.stop()


def _is_terminal() -> bool:
    """Return whether stderr is one; a process may have none at all."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def progress_bar(task: str) -> Iterator[Callable[[int, int], None]]:
    """Show how much of a long task is done on stderr, on a terminal only.

    Yields
    ------
    on_done
        To be called with the number of parts that are done and the number of all.

    """
    if not _is_terminal():
        yield lambda _done, _all: None
        return
    from rich.console import Console  # noqa: PLC0415 - as above
    from rich.progress import (  # noqa: PLC0415 - as above
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn(task), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        row = bar.add_task(task, total=None)
        yield lambda done, all_: bar.update(row, completed=done, total=all_)
