"""ESRI ASCII grids: heights as text, north first."""

from __future__ import annotations

import re

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.io.grid_points import points_of_grid
from divespot.io.scan import RawCloud

BEGINS = re.compile(rb"(?i)\s*ncols\s")
_LINE = re.compile(rb"(?i)\s*([a-z_]+)[ \t]+(\S+)[ \t]*(?:[\r\n]+|\Z)")
_NEEDED = ("ncols", "nrows", "xllcorner or xllcenter", "yllcorner or yllcenter", "cellsize")


def read_esri(data: bytes) -> RawCloud:
    """Read the centre of each cell of an ESRI grid; a cell without data has no height."""
    header, start = _header(data)
    try:
        columns, rows = int(header["ncols"]), int(header["nrows"])
        cell, nothing = float(header["cellsize"]), float(header.get("nodata_value", "nan"))
        west, south = (_edge(header, axis, cell) for axis in "xy")
    except (KeyError, ValueError):
        raise DivespotError(
            f"its ESRI grid header lacks a number: {', '.join(_NEEDED)} are needed"
        ) from None
    words = data[start:].replace(b",", b".").split()
    if min(columns, rows) < 1 or len(words) != columns * rows:
        raise damaged(
            f"its ESRI grid header promises {rows} rows of {columns} heights but {len(words)} "
            "follow"
        )
    try:
        heights = np.array(words, dtype=np.float64).reshape(rows, columns)
    except ValueError as err:
        raise DivespotError(f"a height of its grid is no number ({err}): one is needed") from None
    heights[heights == nothing] = np.nan
    north = south + rows * cell
    return RawCloud(points_of_grid(heights, (cell, 0.0, west, 0.0, -cell, north)), projected=True)


def _header(data: bytes) -> tuple[dict[str, str], int]:
    """Return the header's values by their names in lower case, and where the heights begin."""
    found: dict[str, str] = {}
    at = 0
    while match := _LINE.match(data, at):
        found[match[1].decode().lower()] = match[2].decode("ascii", "replace").replace(",", ".")
        at = match.end()
    return found, at


def _edge(header: dict[str, str], axis: str, cell: float) -> float:
    """Return the coordinate of the grid's outer edge along an axis."""
    if f"{axis}llcenter" in header:
        return float(header[f"{axis}llcenter"]) - cell / 2
    return float(header[f"{axis}llcorner"])
