"""PCD (Point Cloud Library), ascii, binary and binary_compressed.

Not read with pypcd4, which takes fewer points than the header promises without an error, allocates
what a header asks for before it looks at the file, refuses headers that PCL accepts (version .6,
no COUNT, two blanks in a row) and depends on pydantic.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot._native import lzf_decompress
from divespot.errors import DivespotError, damaged
from divespot.io.header import find_header
from divespot.io.records import axes_of, require_bytes, unpack_records
from divespot.io.scan import FloatArray, RawCloud, stack
from divespot.io.table import number_rows, parse_rows, split_lines

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TYPES = {
    *(("F", size) for size in (4, 8)),
    *((kind, size) for kind in "IU" for size in (1, 2, 4, 8)),
}
# The quaternion w, x, y, z of a sensor without rotation.
_NO_TURN = (1.0, 0.0, 0.0, 0.0)

Place: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class _Field:
    name: str
    kind: str
    size: int
    count: int

    @property
    def width(self) -> int:
        return self.size * self.count

    @property
    def dtype(self) -> str:
        return f"<{self.kind.lower()}{self.size}"


@dataclass(frozen=True)
class _Header:
    fields: list[_Field]
    points: int
    encoding: str
    size: int
    lines: int
    viewpoint: Place | None
    raster: tuple[int, int] | None

    @property
    def stride(self) -> int:
        return sum(f.width for f in self.fields)


def read_pcd(data: bytes) -> RawCloud:
    """Read x, y, z of a PCD file, in its own frame (VIEWPOINT is not applied to them)."""
    header = _parse_header(data)
    readers = {
        "ascii": _read_ascii,
        "binary": _read_binary,
        "binary_compressed": _read_compressed,
    }
    if header.encoding not in readers:
        raise DivespotError(
            f"PCD data is {header.encoding!r}: one of {', '.join(readers)} is needed"
        )
    if header.points == 0:
        return RawCloud(np.empty((0, 3)))
    xyz = readers[header.encoding](data, header)
    return RawCloud(xyz, viewpoint=header.viewpoint, raster=header.raster)


def _parse_header(data: bytes) -> _Header:
    text = find_header(data, rb"DATA[ \t]+(\w+)")
    if text is None:
        raise damaged("the PCD header has no DATA line")
    lines = text.lines
    entries = {words[0]: words[1:] for words in map(str.split, lines) if words}
    try:
        fields = _parse_fields(entries)
        # Before version .7 a file may state only the number of its points.
        width = int(entries["WIDTH" if "WIDTH" in entries else "POINTS"][0])
        height = int(entries.get("HEIGHT", ["1"])[0])
        shape = width * height
        points = int(entries["POINTS"][0]) if "POINTS" in entries else shape
    except (KeyError, IndexError, ValueError):
        raise DivespotError(
            "the PCD header lacks an entry: FIELDS, SIZE, TYPE of one length, and WIDTH and "
            "HEIGHT, or POINTS, are needed"
        ) from None
    if points != shape or points < 0:
        raise DivespotError(
            f"the PCD header says POINTS {points} but WIDTH x HEIGHT {shape}: one number is needed"
        )
    _require_types(fields)
    place = _viewpoint(entries.get("VIEWPOINT", []))
    raster = (height, width) if min(height, width) > 1 else None
    return _Header(fields, points, text.word, text.size, len(lines) + 1, place, raster)


def _viewpoint(words: list[str]) -> Place | None:
    """Return the sensor's position; None for values that mean unknown, or for invalid ones."""
    try:
        x, y, z, *turn = (float(word) for word in words)
    except ValueError:
        return None
    known = len(turn) == len(_NO_TURN) and (x, y, z, *turn) != (0.0, 0.0, 0.0, *_NO_TURN)
    return (x, y, z) if known and all(map(math.isfinite, (x, y, z, *turn))) else None


def _parse_fields(entries: dict[str, list[str]]) -> list[_Field]:
    """Return the fields; version .5 calls them COLUMNS, and PCL's default is float32."""
    names = entries["FIELDS"] if "FIELDS" in entries else entries["COLUMNS"]
    kinds = entries.get("TYPE", ["F"] * len(names))
    sizes = [int(size) for size in entries.get("SIZE", ["4"] * len(names))]
    counts = [int(count) for count in entries.get("COUNT", ["1"] * len(names))]
    return [_Field(*part) for part in zip(names, kinds, sizes, counts, strict=True)]


def _require_types(fields: list[_Field]) -> None:
    axes = axes_of((f.name for f in fields), "PCD fields")
    for f in fields:
        if (f.kind, f.size) not in _TYPES or f.count < 1 or (f.name in axes and f.count != 1):
            raise DivespotError(
                f"PCD field {f.name!r} has TYPE {f.kind} SIZE {f.size} COUNT {f.count}: "
                "F of 4 or 8, I or U of 1, 2, 4 or 8 bytes, and COUNT 1 for x, y, z are needed"
            )


def _offsets(fields: list[_Field], scale: int = 1) -> dict[str, tuple[str, int]]:
    """Return type and byte offset of each field, with each field `scale` values wide."""
    found: dict[str, tuple[str, int]] = {}
    at = 0
    for f in fields:
        found.setdefault(f.name, (f.dtype, at))
        at += f.width * scale
    return found


def _read_ascii(data: bytes, header: _Header) -> FloatArray:
    rows, numbers = number_rows(split_lines(data[header.size :]), header.lines + 1)
    if len(rows) != header.points:
        raise damaged(
            f"the header promises {header.points} points but the file holds {len(rows)} rows"
        )
    if not rows:
        return np.empty((0, 3))
    width = sum(f.count for f in header.fields)
    if len(rows[0].split()) != width:
        raise DivespotError(
            f"line {numbers[0]} has {len(rows[0].split())} values: {width}, as in the header, are "
            "needed"
        )
    names = [f.name for f in header.fields]
    before = [names.index(axis) for axis in axes_of(names, "PCD fields")]
    x, y, z = (sum(f.count for f in header.fields[:index]) for index in before)
    return parse_rows(rows, numbers, (x, y, z))


def _read_binary(data: bytes, header: _Header) -> FloatArray:
    fields = _offsets(header.fields)
    return unpack_records(data, header.size, header.points, fields, header.stride)


def _read_compressed(data: bytes, header: _Header) -> FloatArray:
    """Read fields stored one after the other, each for all points, compressed by LZF."""
    body = _decompress(data, header)
    offsets = _offsets(header.fields, header.points)
    axes = (offsets[axis] for axis in axes_of(offsets, "PCD fields"))
    return stack([np.frombuffer(body, dtype, header.points, at) for dtype, at in axes])


def _decompress(data: bytes, header: _Header) -> NDArray[np.uint8]:
    start = header.size + 8
    require_bytes(8, len(data) - header.size, header.points)
    packed, unpacked = struct.unpack_from("<II", data, header.size)
    require_bytes(packed, len(data) - start, header.points)
    if unpacked != header.points * header.stride:
        raise damaged(
            f"the header promises {header.points} points of {header.stride} bytes, its compressed "
            f"body {unpacked} bytes from {packed}"
        )
    return lzf_decompress(data[start : start + packed], unpacked)
