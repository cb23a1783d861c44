"""Output on a terminal."""

from __future__ import annotations

import shutil
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

F = TypeVar("F", bound="Callable[..., Any]")

#: Tasks that take less time, in seconds, get no progress line.
PATIENCE_S = 1.0


def file_name(path: str | os.PathLike[str]) -> str:
    """Return a file's name without control characters, for a terminal."""
    return printable(click.format_filename(path))


def tell(line: str) -> None:
    """Print a line on stderr; if it is closed, do nothing."""
    with suppress(OSError, ValueError):
        click.echo(line, err=True)


def loudness_options(command: F) -> F:
    """Add ``--verbose``, which logs on stderr, and ``--quiet``, which the command reads."""
    verbose = click.option(
        *("-v", "--verbose"),
        is_flag=True,
        expose_value=False,
        callback=_log,
        help="print each stage with its time on stderr",
    )
    quiet = click.option(
        *("-q", "--quiet"), is_flag=True, help="print only errors: no table, no warnings"
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
    shown = _Line(task)
    # A single stage may take long, so a thread updates the time.
    timer = threading.Timer(PATIENCE_S, shown.begin)
    timer.daemon = True
    timer.start()
    try:
        yield shown.tell
    finally:
        timer.cancel()
        timer.join()
        shown.end()


class _Line:
    """One line on a terminal that is overwritten, and finally blanked."""

    def __init__(self, task: str) -> None:
        self._task, self._stage = task, ""
        self._begun, self._written = False, 0
        self._lock = threading.Lock()

    def begin(self) -> None:
        with self._lock:
            self._begun = True
            self._write()

    def tell(self, stage: str) -> None:
        with self._lock:
            self._stage = stage
            if self._begun:
                self._write()

    def end(self) -> None:
        if self._begun:
            _echo("\r" + " " * self._written + "\r")

    def _write(self) -> None:
        room = shutil.get_terminal_size().columns - 1
        text = f"{self._task}: {self._stage}"[:room]
        _echo("\r" + text.ljust(self._written))
        self._written = len(text)


def _echo(text: str) -> None:
    with suppress(OSError, ValueError):
        click.echo(text, nl=False, err=True)


def _is_terminal() -> bool:
    """Return whether stderr is a terminal; a process may have no stderr at all."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def progress_bar(task: str) -> Iterator[Callable[[int, int], None]]:
    """Show on stderr how much of a long task is done, on a terminal only.

    Yields
    ------
    on_done
        To be called with the number of parts that are done and the number of all.

    """
    if not _is_terminal():
        yield lambda _done, _all: None
        return
    with click.progressbar(length=1, label=task, file=sys.stderr, show_pos=True) as bar:

        def show(done: int, all_: int) -> None:
            bar.length = all_
            bar.update(done - bar.pos)

        yield show
