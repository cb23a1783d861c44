"""XYZ, CSV, TXT, ASC, PTS: points as lines of text."""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from divespot.errors import DivespotError, damaged
from divespot.io.columns import OFFER, Columns, asked, named, numbered, unnamed
from divespot.io.records import refuse_image
from divespot.io.scan import RawCloud
from divespot.io.table import is_number, number_rows, parse_rows, split_lines, uncomment

if TYPE_CHECKING:
    from divespot.io.wanted import Wanted

_MAX_HEADER_LINES = 200
_MAX_HEADER_CHARS = 20_000
_MAX_FIELDS = 10_000
_COMMA_NUMBER = re.compile(r"[+-]?\d+(,\d+)?(e[+-]?\d+)?", re.IGNORECASE)
# This many rows whose first field counts up are no coincidence.
_ENOUGH_ROWS = 10


@dataclass(frozen=True)
class _Layout:
    """Where the table begins, and how its rows are read."""

    start: int
    delimiter: str | None
    promised: int | None = None
    columns: Columns = field(default_factory=Columns)
    # Whether a header or the caller names the columns.
    certain: bool = False


def read_text(data: bytes, wanted: Wanted) -> RawCloud:
    """Read lines of numbers; see `divespot.io.read` for what is understood.

    The fields are separated by semicolons, tabs, commas or blanks; a comma that is not a separator
    is a decimal sign. Columns named x, y, z (or easting, northing, elevation and the like) in a
    header line are used; without one, the columns after a first column that counts rows, otherwise
    the first three. A line with a single integer before the first row is the number of
    rows (PTS); another such block may follow.
    """
    lines = split_lines(data)
    layout = _find_layout(lines, wanted)
    rows, numbers = number_rows(lines[layout.start :], layout.start + 1)
    if layout.delimiter != ",":
        rows = [row.replace(",", ".") for row in rows]
    if layout.promised is not None:
        rows, numbers = _without_counts(rows, numbers, layout.promised)
    columns = layout.columns if layout.certain else _judged(rows, layout)
    xyz = parse_rows(rows, numbers, columns.at, layout.delimiter)
    return RawCloud(
        xyz,
        unit=columns.unit,
        vertical_unit=columns.vertical_unit,
        warnings=columns.warnings,
    )


def _without_counts(
    rows: list[str], numbers: list[int], promised: int
) -> tuple[list[str], list[int]]:
    """Return the rows of the clouds of a PTS file, each of which comes after its count."""
    parts: list[slice] = []
    at, line = 0, "its first line"
    while True:
        end = at + promised
        follows = rows[end] if end < len(rows) else ""
        if end > len(rows) or (follows and not (follows.isdecimal() and len(follows) < 19)):
            raise damaged(f"{line} promises {promised} points but {len(rows) - at} rows follow")
        parts.append(slice(at, end))
        if not follows:
            break
        at, line, promised = end + 1, f"line {numbers[end]}", int(follows)
    chain = itertools.chain.from_iterable
    return list(chain(rows[part] for part in parts)), list(chain(numbers[part] for part in parts))


def _find_layout(lines: list[str], wanted: Wanted) -> _Layout:
    """Find the first row of numbers and the header that belongs to it."""
    header: list[str] = []
    promised = None
    for index, line in enumerate(lines):
        row = uncomment(line)
        if not row and not line.strip():
            continue
        layout = _row_layout(index, row, header, promised, wanted) if row else None
        if layout is not None:
            return layout
        if row.isdecimal() and len(row) < 19:
            promised = int(row)
        header.append(line.strip()[:_MAX_HEADER_CHARS])
        if len(header) > _MAX_HEADER_LINES:
            break
    if wanted.columns is not None:
        asked_for = ", ".join(wanted.columns)
        raise DivespotError(f"no row has numbers in columns {asked_for}: other columns are needed")
    raise DivespotError("no line has three numbers x y z: one point per line is needed")


def _row_layout(
    start: int, row: str, header: list[str], promised: int | None, wanted: Wanted
) -> _Layout | None:
    """Return how to read the table if `row` is its first row, otherwise None."""
    delimiter = _delimiter(row)
    fields = _fields(row, delimiter)
    if len(fields) > _MAX_FIELDS:
        raise DivespotError(
            f"line {start + 1} has {len(fields)} fields: one point per line is needed"
        )
    if wanted.columns is not None:
        columns = asked(wanted.columns, header, len(fields))
        if columns is None or not _are_numbers(fields, columns.at, delimiter):
            return None
        return _Layout(start, delimiter, promised, columns, certain=True)
    for line in reversed(header):
        columns = named(line, len(fields)) if _may_head(fields, delimiter) else None
        if columns is not None and _are_numbers(fields, columns.at, delimiter):
            return _Layout(start, delimiter, promised, columns, certain=True)
    if not _are_numbers(fields, (0, 1, 2), delimiter):
        return None
    warnings = unnamed(header[-1], len(fields)) if header else ()
    return _Layout(start, delimiter, promised, Columns(warnings=warnings))


def _may_head(fields: list[str], delimiter: str | None) -> bool:
    """Return whether a row has at least three numbers."""
    return sum(_are_numbers([part], (0,), delimiter) for part in fields[:_MAX_FIELDS]) >= 3


def _judged(rows: list[str], layout: _Layout) -> Columns:
    """Return the columns of x, y, z of a table that does not name them."""
    fields = _fields(rows[0], layout.delimiter)
    refuse_image(len(rows), len(fields))
    if len(fields) < 4 or not _are_numbers(fields, (0, 1, 2, 3), layout.delimiter):
        return layout.columns
    if len(rows) < _ENOUGH_ROWS or not _count_up(rows, layout.delimiter):
        return layout.columns
    if layout.columns.warnings:
        raise DivespotError(f"its first column counts up as point numbers do: {OFFER}")
    return numbered([float(part) for part in fields[:4]])


def _count_up(rows: list[str], delimiter: str | None) -> bool:
    """Return whether the first fields are integers, each larger than the previous one."""
    last = -1
    for row in rows:
        word = row.split(delimiter, 1)[0].strip()
        if not (word.isascii() and word.isdecimal() and len(word) < 19 and int(word) > last):
            return False
        last = int(word)
    return True


def _delimiter(row: str) -> str | None:
    for mark in (";", "\t"):
        if row.count(mark) >= 2:
            return mark
    fields = row.split()
    decimal_commas = len(fields) >= 3 and all(map(_COMMA_NUMBER.fullmatch, fields[:3]))
    return "," if "," in row and not decimal_commas else None


def _fields(row: str, delimiter: str | None) -> list[str]:
    """Return a row's fields, without empty ones at its end."""
    return row.rstrip(f" {delimiter or ''}").split(delimiter)


def _are_numbers(fields: list[str], columns: tuple[int, ...], delimiter: str | None) -> bool:
    if max(columns) >= len(fields):
        return False
    chosen = (fields[column] for column in columns)
    return all(is_number(f if delimiter == "," else f.replace(",", ".")) for f in chosen)
