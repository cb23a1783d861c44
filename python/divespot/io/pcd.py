"""PCD (Point Cloud Library), ascii, binary and binary_compressed.

Read here and not by pypcd4: it takes fewer points than the header promises without a word,
allocates what a header asks for before looking at the file, refuses headers that PCL accepts
(version .6, no COUNT, two blanks in a row) and brings pydantic along. The LZF body is
decompressed by python-neo-lzf.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from divespot.errors import DivespotError
from divespot.io.records import require_axes, require_bytes, unpack_records
from divespot.io.scan import FloatArray, RawCloud, stack
from divespot.io.table import number_rows, parse_rows, split_lines

_DATA_LINE = re.compile(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", re.MULTILINE)
_MAX_HEADER_BYTES = 1 << 20
_TYPES = {
    *(("F", size) for size in (4, 8)),
    *((kind, size) for kind in "IU" for size in (1, 2, 4, 8)),
}
# A back reference of 3 bytes yields at most 264 bytes.
_LZF_MAX_RATIO = 88
# The quaternion w, x, y, z of a sensor that is not turned.
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
        raise DivespotError(f"PCD data is {header.encoding!r}: need one of {', '.join(readers)}")
    xyz = readers[header.encoding](data, header)
    return RawCloud(xyz, viewpoint=header.viewpoint, raster=header.raster)


def _parse_header(data: bytes) -> _Header:
    end = _DATA_LINE.search(data, 0, _MAX_HEADER_BYTES)
    if end is None:
        raise DivespotError("the PCD header has no DATA line: it is truncated")
    lines = data[: end.start()].decode("utf-8", "replace").rstrip("\n").split("\n")
    entries = {words[0]: words[1:] for words in map(str.split, lines) if words}
    try:
        fields = _parse_fields(entries)
        width, height = int(entries["WIDTH"][0]), int(entries["HEIGHT"][0])
        shape = width * height
        points = int(entries["POINTS"][0]) if "POINTS" in entries else shape
    except (KeyError, IndexError, ValueError):
        raise DivespotError(
            "the PCD header needs FIELDS, SIZE, TYPE of one length, and WIDTH, HEIGHT, POINTS"
        ) from None
    if points != shape or points < 0:
        raise DivespotError(f"the PCD header says POINTS {points} but WIDTH x HEIGHT {shape}")
    _require_types(fields)
    place = _viewpoint(entries.get("VIEWPOINT", []))
    raster = (height, width) if min(height, width) > 1 else None
    return _Header(fields, points, end[1].decode(), end.end(), len(lines) + 1, place, raster)


def _viewpoint(words: list[str]) -> Place | None:
    """Return where the sensor stood; None of what writers say who do not know, or of nonsense."""
    try:
        x, y, z, *turn = (float(word) for word in words)
    except ValueError:
        return None
    known = len(turn) == len(_NO_TURN) and (x, y, z, *turn) != (0.0, 0.0, 0.0, *_NO_TURN)
    return (x, y, z) if known and all(map(math.isfinite, (x, y, z, *turn))) else None


def _parse_fields(entries: dict[str, list[str]]) -> list[_Field]:
    names = entries["FIELDS"]
    sizes = [int(size) for size in entries["SIZE"]]
    counts = [int(count) for count in entries.get("COUNT", ["1"] * len(names))]
    parts = zip(names, entries["TYPE"], sizes, counts, strict=True)
    return [_Field(*part) for part in parts]


def _require_types(fields: list[_Field]) -> None:
    by_name = {f.name: f for f in fields}
    require_axes(by_name, "PCD fields")
    for f in fields:
        if (f.kind, f.size) not in _TYPES or f.count < 1 or (f.name in "xyz" and f.count != 1):
            raise DivespotError(
                f"PCD field {f.name!r} has TYPE {f.kind} SIZE {f.size} COUNT {f.count}: "
                "need F of 4 or 8, I or U of 1, 2, 4 or 8 bytes, and COUNT 1 for x, y, z"
            )


def _offsets(fields: list[_Field], scale: int = 1) -> dict[str, tuple[str, int]]:
    """Return type and byte offset of each field, each of them `scale` records wide."""
    found = {}
    at = 0
    for f in fields:
        found[f.name] = (f.dtype, at)
        at += f.width * scale
    return found


def _read_ascii(data: bytes, header: _Header) -> FloatArray:
    rows, numbers = number_rows(split_lines(data[header.size :]), header.lines + 1)
    if len(rows) != header.points:
        raise DivespotError(
            f"the header promises {header.points} points but the file holds {len(rows)} rows: "
            "it is truncated or corrupt"
        )
    if not rows:
        return np.empty((0, 3))
    names = [name for f in header.fields for name in [f.name] * f.count]
    if len(rows[0].split()) != len(names):
        raise DivespotError(
            f"line {numbers[0]} has {len(rows[0].split())} values: the header names {len(names)}"
        )
    return parse_rows(rows, numbers, (names.index("x"), names.index("y"), names.index("z")))


def _read_binary(data: bytes, header: _Header) -> FloatArray:
    fields = _offsets(header.fields)
    return unpack_records(data, header.size, header.points, fields, header.stride)


def _read_compressed(data: bytes, header: _Header) -> FloatArray:
    """Read the fields one after the other, each of them for all points, under LZF."""
    body = _decompress(data, header)
    columns = []
    for axis, (dtype, offset) in _offsets(header.fields, header.points).items():
        if axis in "xyz":
            columns.append((axis, np.frombuffer(body, dtype, header.points, offset)))
    return stack([column for _, column in sorted(columns, key=lambda pair: pair[0])])


def _decompress(data: bytes, header: _Header) -> bytes:
    import lzf  # noqa: PLC0415  (only compressed PCD needs it)

    start = header.size + 8
    require_bytes(8, len(data) - header.size, header.points)
    packed, unpacked = struct.unpack_from("<II", data, header.size)
    require_bytes(packed, len(data) - start, header.points)
    if unpacked != header.points * header.stride or unpacked > packed * _LZF_MAX_RATIO:
        raise DivespotError(
            f"the header promises {header.points} points of {header.stride} bytes, its compressed "
            f"body {unpacked} bytes from {packed}: it is corrupt"
        )
    try:
        body: bytes | None = lzf.decompress(data[start : start + packed], unpacked)
    except ValueError:
        body = None
    if body is None or len(body) != unpacked:
        raise DivespotError("its LZF-compressed body cannot be decompressed: it is corrupt")
    return body
