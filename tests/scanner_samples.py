"""PTX and E57 files built by hand."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Columns = dict[str, NDArray[Any]]
    Scan = tuple[Columns, tuple[float, ...] | None]

# A turn by 90 degrees about z: x to y, y to -x.
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
PLACE = (100.0, 200.0, 5.0)
SEEN = np.array([[1.0, 2.0, 3.0], [0.0, 0.0, 0.0], [4.0, -5.0, 6.0]])
MOVED = np.array([[98.0, 201.0, 8.0], [0.0, 0.0, 0.0], [105.0, 204.0, 11.0]])
"""`SEEN` after `TURN` and `PLACE`; what was not seen stays so."""

LEVEL = np.eye(3)
NOWHERE = (0.0, 0.0, 0.0)
PAGE, CHECKSUM = 1024, 4
_POLYNOMIAL = 0x82F63B78


def ptx(
    points: NDArray[Any], turn: NDArray[Any] = LEVEL, place: Sequence[float] = NOWHERE
) -> bytes:
    """Return one scan of a raster of one column."""
    head = [str(len(points)), "1", " ".join(map(repr, map(float, place)))]
    head += [" ".join(map(repr, axis)) for axis in turn.T.tolist()]
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = turn.T, place
    head += [" ".join(map(repr, row)) for row in matrix.tolist()]
    rows = [f"{x!r} {y!r} {z!r} 0.5" for x, y, z in points.tolist()]
    return ("\n".join([*head, *rows]) + "\n").encode()


def cartesian(points: NDArray[Any]) -> Columns:
    return {f"cartesian{axis}": points[:, i] for i, axis in enumerate("XYZ")}


def e57(*scans: Scan, wkt: str = "", promised: int | None = None) -> bytes:
    """Return a file of scans: columns of float64 or of bytes by the name, and a pose."""
    body, children = bytearray(48), ""
    for columns, pose in scans:
        at = len(body)
        body += _section(columns, at)
        children += _child(columns, pose, _physical(at), promised)
    xml = _xml(children, wkt).encode()
    start = len(body)
    body += xml
    pages = -(-len(body) // (PAGE - CHECKSUM))
    body += bytes(pages * (PAGE - CHECKSUM) - len(body))
    sizes = (1, 0, pages * PAGE, _physical(start), len(xml), PAGE)
    body[:48] = b"ASTM-E57" + struct.pack("<IIQQQQ", *sizes)
    return with_checksums(bytes(body))


def with_checksums(body: bytes) -> bytes:
    """Return pages of a body, each with its CRC-32C."""
    step = PAGE - CHECKSUM
    parts = (body[at : at + step] for at in range(0, len(body), step))
    return b"".join(part + struct.pack(">I", _crc32c(part)) for part in parts)


def without_checksums(data: bytes) -> bytes:
    return b"".join(data[at : at + PAGE - CHECKSUM] for at in range(0, len(data), PAGE))


def _physical(at: int) -> int:
    return at + CHECKSUM * (at // (PAGE - CHECKSUM))


def _section(columns: Columns, at: int) -> bytes:
    streams = [_stream(values) for values in columns.values()]
    sizes = struct.pack(f"<{len(streams)}H", *map(len, streams))
    packet = sizes + b"".join(streams)
    packet += bytes(-(len(packet) + 6) % 4)
    packet = struct.pack("<BBHH", 1, 0, len(packet) + 5, len(streams)) + packet
    head = struct.pack("<B7xQQQ", 1, 32 + len(packet), _physical(at + 32), 0)
    return head + packet


def _stream(values: NDArray[Any]) -> bytes:
    """Return float64, or bytes for what is whole."""
    return values.astype("<f8" if values.dtype.kind == "f" else "u1").tobytes()


def _child(
    columns: Columns, pose: tuple[float, ...] | None, offset: int, promised: int | None
) -> str:
    count = len(next(iter(columns.values()))) if promised is None else promised
    kinds = {"f": 'type="Float"', "u": 'type="Integer" minimum="0" maximum="255"'}
    prototype = "".join(f"<{name} {kinds[v.dtype.kind]}/>" for name, v in columns.items())
    points = f'<points type="CompressedVector" fileOffset="{offset}" recordCount="{count}">'
    points += f'<prototype type="Structure">{prototype}</prototype></points>'
    placed = "" if pose is None else _pose(pose)
    return (
        f'<vectorChild type="Structure"><guid type="String">a</guid>{placed}{points}</vectorChild>'
    )


def _pose(pose: tuple[float, ...]) -> str:
    def numbers(names: str, values: tuple[float, ...]) -> str:
        pairs = zip(names, values, strict=True)
        return "".join(f'<{name} type="Float">{value!r}</{name}>' for name, value in pairs)

    turn = f'<rotation type="Structure">{numbers("wxyz", pose[:4])}</rotation>'
    place = f'<translation type="Structure">{numbers("xyz", pose[4:])}</translation>'
    return f'<pose type="Structure">{turn}{place}</pose>'


def _xml(children: str, wkt: str) -> str:
    system = f'<coordinateMetadata type="String"><![CDATA[{wkt}]]></coordinateMetadata>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<e57Root type="Structure" '
        'xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0">'
        '<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>'
        '<guid type="String">b</guid><versionMajor type="Integer">1</versionMajor>'
        f'<versionMinor type="Integer">0</versionMinor>{system if wkt else ""}'
        f'<data3D type="Vector">{children}</data3D></e57Root>\n'
    )


def _remainder(byte: int) -> int:
    for _ in range(8):
        byte = (byte >> 1) ^ (_POLYNOMIAL if byte & 1 else 0)
    return byte


_REMAINDERS = [_remainder(byte) for byte in range(256)]


def _crc32c(data: bytes) -> int:
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ _REMAINDERS[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF
