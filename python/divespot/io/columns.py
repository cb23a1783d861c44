"""Which columns of a table are x, y and z."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot.errors import DivespotError
from divespot.io.units import DEGREES, UNITS, unit_named

if TYPE_CHECKING:
    from collections.abc import Sequence

OFFER = "the columns of x, y and z are needed, by number or name (--columns 1,2,3)"

_EAST = "x easting east e rechtswert rechts rw ostwert ost xcoord coordx pointx xcoordinate utmx"
_NORTH = "y northing north n hochwert hoch hw nordwert nord ycoord coordy pointy ycoordinate utmy"
_UP = (
    "z elevation elev height altitude alt h höhe hoehe kote level zcoord coordz pointz zcoordinate"
)
_LONGITUDE, _LATITUDE = ("longitude", "lon", "long"), ("latitude", "lat")
_ALIASES = (
    (*_EAST.split(), *_LONGITUDE),
    (*_NORTH.split(), *_LATITUDE),
    tuple(_UP.split()),
)
_ANY = frozenset(alias for aliases in _ALIASES for alias in aliases)
# Such as: x, or X [mm], or z_m, or Easting (us-ft), or POINT_X.
_NAME = re.compile(r"([^\W\d][\w .-]*?)(?:[\s_]+([a-z-]+)|\s*[\[(]\s*([a-z-]+)\s*[\])])?\s*")
_NOT_LETTERS = re.compile(r"[^a-zäöü]")
_MARKS = (";", "\t", ",")
# UTM: eastings are about 500 km, northings up to 10,000 km.
_EASTINGS_M, _LEAST_NORTHING_M = (1e5, 9.5e5), 1e6


@dataclass(frozen=True)
class Columns:
    """The columns of x, y, z, their unit, and warnings about them."""

    at: tuple[int, int, int] = (0, 1, 2)
    unit: str | None = None
    vertical_unit: str | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Name:
    """A column's name in lower case without separators between words, and the unit at its end."""

    word: str
    unit: str | None


def named(line: str, width: int) -> Columns | None:
    """Return the columns of x, y and z by a header line, for rows `width` fields wide; or None.

    Raises
    ------
    DivespotError
        The header names x, y and z, but another number of columns than the rows have.

    """
    names = _names(line)
    found = [_find(names, aliases) for aliases in _ALIASES]
    at = [column for column in found if column is not None]
    if len(at) < 3:
        return None
    if len(names) != width:
        # A line of prose may contain the words x, y and z.
        if _is_comment(line) or 2 * sum(name.word in _ANY for name in names) <= len(names):
            return None
        raise _uncounted(line, names, width)
    return _columns(line, names, (at[0], at[1], at[2]))


def _uncounted(line: str, names: Sequence[_Name], width: int) -> DivespotError:
    return DivespotError(
        f"its header {line[:80]!r} names {len(names)} columns, its rows have {width}: {OFFER}"
    )


def asked(tokens: Sequence[str], header: Sequence[str], width: int) -> Columns | None:
    """Return the columns asked for by number or name; None if the rows do not have them."""
    line = next((line for line in reversed(header) if len(_names(line)) == width), "")
    names = _names(line)
    written = [part.strip().lower() for part in _parts(line)]
    at = []
    for token in tokens:
        if token.isascii() and token.isdecimal() and 0 < int(token[:9]) <= width:
            at.append(int(token) - 1)
        elif token.lower() in written:
            at.append(written.index(token.lower()))
    return _columns(line, names, (at[0], at[1], at[2])) if len(at) == 3 else None


def unnamed(line: str, width: int) -> tuple[str, ...]:
    """Return warnings about a line above the rows that names columns, but not x, y and z."""
    names = _names(line)
    if _is_comment(line) or width < 3:
        return ()
    if len(names) != width:
        if 1 < len(names) < 2 * sum(name.word in _ANY for name in names):
            raise _uncounted(line, names, width)
        return ()
    if any(name.word in _ANY for name in names):
        raise DivespotError(f"its header {line[:80]!r} names some of x, y, z only: {OFFER}")
    return (f"header {line[:80]!r} does not name x, y, z: the first three columns were taken",)


def numbered(row: Sequence[float]) -> Columns:
    """Return the columns of x, y, z after a point number: northing first, as surveyors write it.

    Easting first only if the sizes of UTM coordinates require it.
    """
    first, second = row[1], row[2]
    low, high = _EASTINGS_M
    if low <= first <= high and second >= _LEAST_NORTHING_M:
        order, at, other = "easting, northing", (1, 2, 3), "3,2,4"
    else:
        order, at, other = "northing, easting", (2, 1, 3), "2,3,4"
    warning = f"its columns were read as point number, {order}, elevation: or --columns {other}"
    return Columns(at, warnings=(warning,))


def _is_comment(line: str) -> bool:
    return line.startswith(("#", "//"))


def _parts(line: str) -> list[str]:
    text = line.lstrip("#/ \t")
    mark = next((mark for mark in _MARKS if mark in text), None)
    return text.split(mark)


def _names(line: str) -> list[_Name]:
    return [_name(part.strip().lower()) for part in _parts(line)]


def _name(text: str) -> _Name:
    match = _NAME.fullmatch(text)
    if match is None:
        return _Name("", None)
    suffix = match[2] or match[3] or ""
    unit = suffix if suffix in UNITS else unit_named(suffix)
    whole = text if unit is None and match[3] is None else match[1]
    return _Name(_NOT_LETTERS.sub("", whole), unit)


def _find(names: Sequence[_Name], aliases: Sequence[str]) -> int | None:
    words = [name.word for name in names]
    return next((words.index(alias) for alias in aliases if alias in words), None)


def _columns(line: str, names: Sequence[_Name], at: tuple[int, int, int]) -> Columns:
    x, y, z = (names[column] if column < len(names) else _Name("", None) for column in at)
    if x.unit != y.unit:
        raise DivespotError(
            f"its header {line[:80]!r} gives x and y different units: one is needed"
        )
    degrees = x.word in _LONGITUDE or y.word in _LATITUDE
    return Columns(at, DEGREES if degrees else x.unit, z.unit)
