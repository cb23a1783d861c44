"""XYZ, CSV, TXT, ASC, PTS: points as lines of text."""

from __future__ import annotations

import re
from dataclasses import dataclass

from divespot.errors import DivespotError
from divespot.io.scan import RawCloud
from divespot.io.table import is_number, number_rows, parse_rows, split_lines, uncomment
from divespot.io.units import UNITS

_MAX_HEADER_LINES = 200
_ALIASES = {
    "x": ("x", "easting", "east"),
    "y": ("y", "northing", "north"),
    "z": ("z", "elevation", "elev", "height", "altitude"),
}
_UNIT_TEXT = "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True))
# Such as: x, or X [mm], or z_m, or Easting (us-ft).
_NAME = re.compile(
    rf"([a-z]+)(?:[\s_]+({_UNIT_TEXT})|\s*[\[(]\s*({_UNIT_TEXT})\s*[\])])?", re.IGNORECASE
)
_COMMA_NUMBER = re.compile(r"[+-]?\d+(,\d+)?(e[+-]?\d+)?", re.IGNORECASE)


@dataclass(frozen=True)
class _Layout:
    """Where the table begins and how its rows are to be read."""

    start: int
    delimiter: str | None
    columns: tuple[int, int, int] = (0, 1, 2)
    unit: str | None = None
    promised: int | None = None
    warnings: tuple[str, ...] = ()


def read_text(data: bytes) -> RawCloud:
    """Read lines of numbers; see `divespot.io.read` for what is understood.

    The fields are separated by semicolons, tabs, commas or blanks; a comma is a decimal sign
    where it does not separate. Columns named x, y, z (or easting, northing, elevation) in a
    header line are used, otherwise the first three. A line with one whole number before the
    first row is the number of rows (PTS).
    """
    lines = split_lines(data)
    layout = _find_layout(lines)
    rows, numbers = number_rows(lines[layout.start :], layout.start + 1)
    if layout.delimiter != ",":
        rows = [row.replace(",", ".") for row in rows]
    if layout.promised is not None and layout.promised != len(rows):
        raise DivespotError(
            f"its first line promises {layout.promised} points but {len(rows)} rows follow: "
            "it is truncated or corrupt"
        )
    xyz = parse_rows(rows, numbers, layout.columns, layout.delimiter)
    return RawCloud(xyz, unit=layout.unit, warnings=layout.warnings)


def _find_layout(lines: list[str]) -> _Layout:
    """Find the first row of numbers and the header that belongs to it."""
    header: list[str] = []
    promised = None
    for index, line in enumerate(lines):
        row = uncomment(line)
        if not row and not line.strip():
            continue
        layout = _row_layout(index, row, header, promised) if row else None
        if layout is not None:
            return layout
        if row.isdecimal() and len(row) < 19:
            promised = int(row)
        elif row.lower().startswith("ncols"):
            raise DivespotError("it is an ESRI grid of heights, need a list of x y z points")
        header.append(line.strip())
        if len(header) > _MAX_HEADER_LINES:
            break
    raise DivespotError("no line has three numbers x y z: need one point a line")


def _row_layout(start: int, row: str, header: list[str], promised: int | None) -> _Layout | None:
    """Return how to read the table if `row` is its first row, else None."""
    delimiter = _delimiter(row)
    fields = row.split(delimiter)
    for line in reversed(header):
        named = _named_columns(line, len(fields))
        if named is not None and _are_numbers(fields, named[0], delimiter):
            columns, unit = named
            return _Layout(start, delimiter, columns, unit, promised)
    if not _are_numbers(fields, (0, 1, 2), delimiter):
        return None
    warnings = _unnamed_columns(header[-1], len(fields)) if header else ()
    return _Layout(start, delimiter, promised=promised, warnings=warnings)


def _delimiter(row: str) -> str | None:
    for mark in (";", "\t"):
        if row.count(mark) >= 2:
            return mark
    fields = row.split()
    decimal_commas = len(fields) >= 3 and all(map(_COMMA_NUMBER.fullmatch, fields[:3]))
    return "," if "," in row and not decimal_commas else None


def _are_numbers(fields: list[str], columns: tuple[int, int, int], delimiter: str | None) -> bool:
    if max(columns) >= len(fields):
        return False
    chosen = (fields[column] for column in columns)
    return all(is_number(f if delimiter == "," else f.replace(",", ".")) for f in chosen)


def _header_names(line: str) -> list[tuple[str, str | None]]:
    """Return the (name, unit) of each column that a header line names."""
    text = line.lstrip("#/ \t").lower()
    mark = next((mark for mark in (";", "\t", ",") if mark in text), None)
    matches = [_NAME.fullmatch(field.strip()) for field in text.split(mark)]
    return [(m[1], m[2] or m[3]) if m else ("", None) for m in matches]


def _named_columns(line: str, width: int) -> tuple[tuple[int, int, int], str | None] | None:
    """Return where a header line puts x, y, z and their common unit, or None if it does not."""
    named = _header_names(line)
    # Prose in a comment may well hold the words x, y and z.
    if len(named) > width or (line.startswith(("#", "//")) and len(named) != width):
        return None
    names = [name for name, _ in named]
    found = [next((names.index(a) for a in _ALIASES[axis] if a in names), None) for axis in "xyz"]
    columns = [column for column in found if column is not None]
    if len(columns) < 3:
        return None
    units = {named[column][1] for column in columns}
    if len(units) > 1:
        raise DivespotError(f"its header {line!r} gives x, y, z different units: need one")
    return (columns[0], columns[1], columns[2]), units.pop()


def _unnamed_columns(line: str, width: int) -> tuple[str, ...]:
    """Judge the line above the rows where it names columns, but not x, y and z."""
    names = [name for name, _ in _header_names(line)]
    if line.startswith(("#", "//")) or len(names) != width or width < 3:
        return ()
    if any(alias in names for aliases in _ALIASES.values() for alias in aliases):
        raise DivespotError(f"its header {line[:80]!r} names some of x, y, z: need all three")
    return (f"header {line[:80]!r} does not name x, y, z: the first three columns were taken",)
