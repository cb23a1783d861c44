"""PTX (Leica): scans as text, each with raster, scanner position and transformation, in metres."""

from __future__ import annotations

import re

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.io.scan import FloatArray, RawCloud
from divespot.io.setups import Setup, merged
from divespot.io.table import number_rows, parse_rows, split_lines

_NUMBER = rb"[-+]?[\d.][-+.\deE]*"
_END = rb"[ \t]*[\r\n]+[ \t]*"


def _row(count: int) -> bytes:
    return rb"[ \t]+".join([_NUMBER] * count) + _END


#: Columns and rows; the scanner's position and axes; the matrix, applied to rows x, y, z, 1.
BEGINS = re.compile(rb"\s*" + (rb"\d+" + _END) * 2 + _row(3) * 4 + _row(4) * 4)
_HEADER_LINES, _MATRIX_LINES = 10, slice(6, 10)


def read_ptx(data: bytes) -> RawCloud:
    """Read x, y, z of all scans of a PTX file, in its common frame; empty pixels are zero."""
    rows, numbers = number_rows(split_lines(data), 1)
    setups, at = [], 0
    while at < len(rows):
        setup, at = _setup(rows, numbers, at)
        setups.append(setup)
    xyz, place = merged([setup for setup in setups if len(setup.xyz)])
    return RawCloud(xyz, unit="m", viewpoint=place)


def _setup(rows: list[str], numbers: list[int], at: int) -> tuple[Setup, int]:
    """Return the scan whose header begins at row `at`, and where the next one begins."""
    begin = at + _HEADER_LINES
    header, line = rows[at:begin], numbers[at]
    count = _count(header, line)
    matrix = _matrix(header, line)
    end = begin + count
    if end > len(rows):
        raise damaged(
            f"the header in line {line} promises {count} points but {len(rows) - begin} rows follow"
        )
    xyz = parse_rows(rows[begin:end], numbers[begin:end], (0, 1, 2)) if count else np.empty((0, 3))
    return Setup(xyz, matrix[:3, :3].T, matrix[3, :3]), end


def _count(header: list[str], line: int) -> int:
    """Return columns times rows."""
    if len(header) < _HEADER_LINES or not all(
        word.isascii() and word.isdecimal() and len(word) < 10 for word in header[:2]
    ):
        raise DivespotError(
            f"line {line} begins no scan (truncated or corrupt): a header of 10 lines is needed"
        )
    return int(header[0]) * int(header[1])


def _matrix(header: list[str], line: int) -> FloatArray:
    try:
        found = [[float(word) for word in row.split()] for row in header[_MATRIX_LINES]]
        return np.array(found).reshape(4, 4)
    except ValueError:
        raise DivespotError(
            f"the header in line {line} has no transformation: 4 rows of 4 numbers are needed"
        ) from None
