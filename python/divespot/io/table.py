"""Rows of numbers as text."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.io.scan import FloatArray

# How various systems' printf writes values that are not numbers.
_NAN = re.compile(r"(?i)\bnan\([^)\n]{0,40}\)|\b1\.?#(?:[QS]NAN|IND)\d*")
_INFINITE = re.compile(r"(?i)\b1\.?#INF\d*")
# NumPy does not check for signals while it parses: this many rows take some tenths of a second.
_ROWS_AT_ONCE = 200_000
_QUOTED = re.compile(r'"([^"\n]*)"')
_COMMA_NUMBER = re.compile(r"\s*[+-]?\d+,\d*(e[+-]?\d+)?\s*", re.IGNORECASE)


def uncomment(line: str) -> str:
    """Return `line` without a comment after ``#`` or ``//``, and without outer blanks."""
    return line.partition("#")[0].partition("//")[0].strip()


def split_lines(data: bytes) -> list[str]:
    """Return the lines of a text file: UTF-8, or UTF-16 with a byte order mark; any line ends.

    Quotes are removed; separators between them are no separators, and a comma within a quoted
    number is a decimal sign.
    """
    utf16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    text = data.decode("utf-16" if utf16 else "utf-8-sig", "replace")
    text = text.lstrip("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    if '"' in text:
        text = _QUOTED.sub(_unquoted, text).replace('"', "")
    if "#" in text or "(" in text:
        text = _INFINITE.sub("inf", _NAN.sub("nan", text))
    # str.splitlines also splits at form feeds and the like, which would shift line numbers.
    return text.split("\n")


def _unquoted(match: re.Match[str]) -> str:
    inner = match[1]
    if _COMMA_NUMBER.fullmatch(inner):
        return inner.replace(",", ".")
    return inner.translate(_NO_MARKS)


_NO_MARKS = str.maketrans(",;\t", "   ")


def number_rows(lines: Sequence[str], first_number: int) -> tuple[list[str], list[int]]:
    """Return the lines that are neither blank nor comment, and their line numbers."""
    stripped = [uncomment(line) for line in lines]
    numbers = [number for number, row in enumerate(stripped, first_number) if row]
    return [row for row in stripped if row], numbers


def parse_rows(
    rows: list[str],
    numbers: Sequence[int],
    columns: tuple[int, int, int],
    delimiter: str | None = None,
) -> FloatArray:
    """Return three columns of a table of numbers.

    Parameters
    ----------
    rows : list of str
        The lines, none of them blank, all with the same number of fields.
    numbers : sequence of int
        The number of each line in its file, for messages.
    columns : tuple of int
        Columns of x, y, z.
    delimiter : str or None
        None is any run of blanks.

    Returns
    -------
    ndarray, shape (n, 3), float64

    Raises
    ------
    DivespotError
        If a row has more or fewer fields than the first, or x, y or z is not a number.
    """
    _require_even(rows, numbers, delimiter)
    how: dict[str, Any] = {"delimiter": delimiter, "usecols": columns, "comments": None, "ndmin": 2}
    begins = range(0, len(rows), _ROWS_AT_ONCE)
    try:
        parts = [np.loadtxt(rows[b : b + _ROWS_AT_ONCE], dtype=np.float64, **how) for b in begins]
        return np.concatenate(parts)
    except ValueError as err:
        _raise_bad_row(rows, numbers, columns, delimiter, err)


def _require_even(rows: list[str], numbers: Sequence[int], delimiter: str | None) -> None:
    widths = [len(row.split(delimiter)) for row in rows]
    width = widths[0]
    if widths.count(width) != len(widths):
        odd = next(i for i, n in enumerate(widths) if n != width)
        raise DivespotError(
            f"line {numbers[odd]} has {widths[odd]} fields where line {numbers[0]} has {width}: "
            "the same number in every row is needed"
        )


def _raise_bad_row(
    rows: list[str],
    numbers: Sequence[int],
    columns: tuple[int, int, int],
    delimiter: str | None,
    err: ValueError,
) -> NoReturn:
    """Raise an error that names the row; NumPy's own row numbers differ."""
    for number, row in zip(numbers, rows, strict=True):
        fields = row.split(delimiter)
        for column in columns:
            if column >= len(fields) or not is_number(fields[column]):
                raise DivespotError(
                    f"line {number} is {row[:60]!r}: a number in field {column + 1} is needed"
                ) from None
    raise DivespotError(f"a row is not numbers ({err}): numbers are needed") from None


def is_number(text: str) -> bool:
    """Return whether `text` is one number (nan and inf are)."""
    try:
        float(text)
    except ValueError:
        return False
    return True
