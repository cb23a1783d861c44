"""Text tables; importing a library for them would take as long as measuring a scan."""

from __future__ import annotations

import io
import shutil
import sys
import textwrap
import unicodedata
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Blanks between two columns, unless there are many.
GAP = 3

#: Width in characters of tables written to a file or a pipe.
FILE_COLUMNS = 120

#: Least width in characters of a column of text, however narrow the terminal is.
NARROWEST = 16


@dataclass(frozen=True)
class _Row:
    cells: tuple[str, ...]
    style: str = ""


@dataclass
class Table:
    """Names at the left, then numbers, and optionally wrapped text at the right.

    Attributes
    ----------
    names
        One per column, of one or more lines.
    text
        Whether the last column is text.
    gap
        Blanks between two columns.

    """

    names: tuple[str, ...]
    text: bool = False
    gap: int = GAP
    _rows: list[_Row | None] = field(default_factory=list)

    def add_row(self, *cells: str, style: str = "") -> None:
        """Add a row; its style is bold, dim or none."""
        self._rows.append(_Row(cells, style))

    def add_section(self) -> None:
        """Add a blank line between the rows before and after."""
        self._rows.append(None)

    @property
    def row_count(self) -> int:
        """The number of rows, without blank lines."""
        return sum(row is not None for row in self._rows)

    def lines(self, most: int) -> Iterator[str]:
        """Yield the lines, at most `most` characters wide if the numbers fit."""
        widths = self._widths(most)
        yield from self._wrapped(_Row(self.names, "bold"), widths)
        yield "─" * (sum(widths) + self.gap * (len(widths) - 1))
        for row in self._without_ends():
            yield from [""] if row is None else self._wrapped(row, widths)

    def _widths(self, most: int) -> list[int]:
        rows = [self.names, *(row.cells for row in self._rows if row is not None)]
        widths = [max(map(_width, column)) for column in zip(*rows, strict=True)]
        if self.text:
            left = most - sum(widths[:-1]) - self.gap * (len(widths) - 1)
            widths[-1] = min(widths[-1], max(left, NARROWEST))
        return widths

    def _without_ends(self) -> list[_Row | None]:
        """Return the rows without blank lines at the beginning and the end."""
        rows = self._rows[:]
        while rows and rows[-1] is None:
            rows.pop()
        return [row for at, row in enumerate(rows) if row is not None or (at and rows[at - 1])]

    def _wrapped(self, row: _Row, widths: list[int]) -> Iterator[str]:
        cells = [cell.split("\n") for cell in row.cells]
        if self.text:
            cells[-1] = textwrap.wrap(row.cells[-1], widths[-1]) or [""]
        height = max(map(len, cells))
        columns = [cell + [""] * (height - len(cell)) for cell in cells]
        for parts in zip(*columns, strict=True):
            yield _styled(self._joined(parts, widths), row.style)

    def _joined(self, parts: tuple[str, ...], widths: list[int]) -> str:
        last = len(parts) - 1
        lefts = {0, last} if self.text else {0}
        padded = (
            _padded(part, width, at_left=at in lefts)
            for at, (part, width) in enumerate(zip(parts, widths, strict=True))
        )
        return (" " * self.gap).join(padded).rstrip()


def show_table(table: Table) -> None:
    """Print a table as wide as the terminal, or `FILE_COLUMNS` wide where there is none."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="replace")  # some terminals cannot show a ±
    for line in table.lines(shutil.get_terminal_size((FILE_COLUMNS, 0)).columns):
        click.echo(line)


def _styled(line: str, style: str) -> str:
    if not style:
        return line
    return click.style(line, bold=style == "bold" or None, dim=style == "dim" or None)


def _padded(part: str, width: int, *, at_left: bool) -> str:
    blanks = " " * (width - _width(part))
    return part + blanks if at_left else blanks + part


def _width(cell: str) -> int:
    """Return the number of columns that a cell takes in a terminal."""
    return max(sum(map(_columns, line)) for line in cell.split("\n"))


def _columns(char: str) -> int:
    if unicodedata.combining(char):
        return 0
    return 2 if unicodedata.east_asian_width(char) in "WF" else 1
