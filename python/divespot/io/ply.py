"""PLY (Stanford polygon format), ascii and both binaries.

Not read with a library: plyfile is GPL; trimesh refuses a cloud whose faces differ in size; meshio
refuses 16-bit properties, further elements or, in ascii, any order but x, y, z. What is needed is a
header of a few lines and one NumPy call.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.extras import is_installed
from divespot.io.header import find_header
from divespot.io.mesh import points_on, triangles_of
from divespot.io.records import axes_of, require_bytes, unpack_records
from divespot.io.scan import FloatArray, RawCloud
from divespot.io.table import number_rows, parse_rows, split_lines

if TYPE_CHECKING:
    from collections.abc import Iterator

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("int64", "long"), "i8"),
    **dict.fromkeys(("uint64", "ulong"), "u8"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_BYTE_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


#: Names of the list of a face's corners.
INDICES = {"vertex_indices", "vertex_index"}

#: A surface has about two triangles per vertex, or one square.
FACE_SHARE = 0.5

#: The fewest bytes of a face: "3 0 1 2", or a count and three bytes.
FACE_BYTES = 4


@dataclass(frozen=True)
class _Property:
    name: str
    dtype: np.dtype[np.generic]
    # The type of a list's length; None for a single value.
    length_dtype: np.dtype[np.generic] | None


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(p.length_dtype is not None for p in self.properties)

    @property
    def stride(self) -> int:
        return sum(p.dtype.itemsize for p in self.properties)


@dataclass(frozen=True)
class _Header:
    byte_order: str
    elements: list[_Element]
    size: int
    lines: int


def read_ply(data: bytes) -> RawCloud:
    """Read x, y, z of the ``vertex`` element of a PLY file."""
    header = _parse_header(data)
    names = [element.name for element in header.elements]
    if "vertex" not in names:
        raise DivespotError("the PLY header has no 'vertex' element: one with x, y and z is needed")
    before = header.elements[: names.index("vertex")]
    vertex = header.elements[len(before)]
    axes_of((p.name for p in vertex.properties), "vertex properties")
    if vertex.has_lists:
        raise DivespotError(
            "the PLY vertex element holds a list property: single values are needed"
        )
    read_body = _read_binary if header.byte_order else _read_ascii
    xyz = read_body(data, header, before, vertex)
    faces = next((element for element in header.elements if element.name == "face"), None)
    if faces is None or not _make_a_surface(faces, vertex):
        return RawCloud(xyz)
    require_bytes(FACE_BYTES * faces.count, len(data) - header.size, vertex.count)
    if not is_installed("trimesh"):
        told = (
            f"its {faces.count} faces were ignored and only its vertices read: "
            "to measure its surface, pip install divespot[mesh]"
        )
        return RawCloud(xyz, warnings=(told,))
    return RawCloud(points_on(triangles_of(data, "ply")))


def _make_a_surface(faces: _Element, vertex: _Element) -> bool:
    """Return whether a file is a mesh, not a cloud with a few faces."""
    lists = {p.name for p in faces.properties if p.length_dtype is not None}
    return bool(lists & INDICES) and faces.count >= FACE_SHARE * vertex.count


def _parse_header(data: bytes) -> _Header:
    text = find_header(data, rb"end_header")
    if text is None:
        raise damaged("the PLY header does not end in 'end_header'")
    lines = text.lines
    order: str | None = None
    elements: list[_Element] = []
    for number, line in enumerate(lines, 1):
        words = line.split()
        if not words or words[0] in ("ply", "comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                order = _BYTE_ORDERS[words[1]]
            else:
                _add(elements, words)
        except (KeyError, IndexError, ValueError):
            raise DivespotError(
                f"PLY header line {number} is {line[:80]!r}: a line of PLY is needed"
            ) from None
    if order is None:
        raise DivespotError("the PLY header has no 'format' line: one is needed")
    return _Header(order, elements, text.size, len(lines) + 1)


def _add(elements: list[_Element], words: list[str]) -> None:
    """Parse an 'element' or 'property' line; KeyError, IndexError or ValueError for others."""
    match words:
        case ["element", name, count] if count.isdecimal():
            elements.append(_Element(name, int(count)))
        case ["property", "list", length, kind, name]:
            prop = _Property(name, np.dtype(_TYPES[kind]), np.dtype(_TYPES[length]))
            elements[-1].properties.append(prop)
        case ["property", kind, name]:
            elements[-1].properties.append(_Property(name, np.dtype(_TYPES[kind]), None))
        case _:
            raise ValueError(words)


def _read_ascii(
    data: bytes, header: _Header, before: list[_Element], vertex: _Element
) -> FloatArray:
    rows, numbers = number_rows(split_lines(data[header.size :]), header.lines + 1)
    start = sum(element.count for element in before)
    names = [p.name for p in vertex.properties]
    columns = tuple(map(names.index, axes_of(names, "vertex properties")))
    if vertex.count == 0:
        return np.empty((0, 3))
    if start < len(rows) and len(rows[start].split()) != len(names):
        tokens = _tokens(rows, header.elements, vertex)
        if tokens is None:
            raise DivespotError(
                f"line {numbers[start]} has {len(rows[start].split())} values: "
                f"{len(names)}, as the header has properties of a vertex, are needed"
            )
        rows, start = tokens, 0
        numbers = [numbers[0]] * len(rows)
    held = max(len(rows) - start, 0)
    if held < vertex.count:
        raise damaged(
            f"the header promises {vertex.count} points but the file holds {held} rows of them"
        )
    stop = start + vertex.count
    return parse_rows(rows[start:stop], numbers[start:stop], (columns[0], columns[1], columns[2]))


def _tokens(rows: list[str], elements: list[_Element], vertex: _Element) -> list[str] | None:
    """Return one row per vertex, wherever lines end; None if the number of values is wrong.

    Programs that write several lines per vertex do so for all vertices.
    """
    tokens = itertools.chain.from_iterable(row.split() for row in rows)
    found: list[str] = []
    for element in elements:
        for _ in range(element.count if element.properties else 0):
            values = _values(tokens, element)
            if values is None:
                return None
            if element is vertex:
                found.append(" ".join(values))
    return found if next(tokens, None) is None else None


def _values(tokens: Iterator[str], element: _Element) -> list[str] | None:
    """Return the values of one row of an element; None if some are missing."""
    values: list[str] = []
    for p in element.properties:
        times = 1
        if p.length_dtype is not None:
            length = next(tokens, "")
            if not length.isdecimal() or len(length) > 9:
                return None
            times = int(length)
        taken = list(itertools.islice(tokens, times))
        if len(taken) < times:
            return None
        values.extend(taken)
    return values


def _read_binary(
    data: bytes, header: _Header, before: list[_Element], vertex: _Element
) -> FloatArray:
    offset = header.size
    for element in before:
        offset = _skip(data, offset, element, header.byte_order)
    fields = {}
    at = 0
    for p in vertex.properties:
        fields[p.name] = (header.byte_order + p.dtype.str[1:], at)
        at += p.dtype.itemsize
    return unpack_records(data, offset, vertex.count, fields, at)


def _skip(data: bytes, offset: int, element: _Element, byte_order: str) -> int:
    """Return where the element that begins at `offset` ends."""
    if not element.has_lists:
        return offset + element.count * element.stride
    big_or_little: Literal["big", "little"] = "big" if byte_order == ">" else "little"
    for _ in range(element.count):
        for p in element.properties:
            times = 1
            if p.length_dtype is not None:
                head = data[offset : offset + p.length_dtype.itemsize]
                if len(head) < p.length_dtype.itemsize:
                    raise damaged(f"it ends inside its {element.count} {element.name!r} lists")
                times = int.from_bytes(head, big_or_little)
                offset += len(head)
            offset += times * p.dtype.itemsize
    return offset
