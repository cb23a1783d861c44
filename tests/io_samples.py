"""Tiny valid files of every format, built by hand or by another library than the reader's."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
import pytest

from divespot import DivespotError
from divespot import io as dio
from lzf_twin import compress
from scanner_samples import cartesian, e57, ptx

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

# Exact in binary and in float32, except the last column of the last row.
POINTS = np.array(
    [[0.0, 0.0, 0.0], [1.5, -2.25, 0.125], [np.nan, 3.0, 4.0], [1.5, -2.25, 0.125], [7.0, 8.0, 9.5]]
)
FINITE = POINTS[[0, 1, 3, 4]]


def ply(
    points: NDArray[Any],
    order: str = "<",
    kinds: tuple[str, str, str] = ("double",) * 3,
    names: str = "xyz",
) -> bytes:
    codes = {"float": "f4", "double": "f8", "short": "i2", "int": "i4", "uchar": "u1"}
    fields = [(name, order + codes[kind]) for name, kind in zip(names, kinds, strict=True)]
    table = np.zeros(len(points), np.dtype([("flag", "u1"), *fields]))
    for axis, name in enumerate("xyz"):
        table[name] = points[:, axis]
    label = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = f"ply\nformat {label} 1.0\ncomment a b\nelement vertex {len(points)}\n"
    head += "property uchar flag\n"
    head += "".join(f"property {k} {n}\n" for k, n in zip(kinds, names, strict=True))
    return (head + "end_header\n").encode() + table.tobytes()


def ply_ascii(points: NDArray[Any]) -> bytes:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\nproperty float z\n"
    head += "property float x\nproperty uchar red\nproperty float y\nelement face 1\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    rows = "".join(f"{z!r} {x!r} 255 {y!r}\n" for x, y, z in points.tolist())
    return (head + rows + "3 0 1 2\n").encode()


def ply_faces_first(points: NDArray[Any], order: str = "<") -> bytes:
    label = "binary_little_endian" if order == "<" else "binary_big_endian"
    head = f"ply\nformat {label} 1.0\nelement face 2\nproperty list uchar int i\n"
    head += (
        f"property uchar red\nelement camera 1\nproperty float f\nelement vertex {len(points)}\n"
    )
    head += "property double x\nproperty double y\nproperty double z\nend_header\n"
    faces = struct.pack(f"{order}B3iBB4iB", 3, 0, 1, 2, 9, 4, 0, 1, 2, 3, 9)
    return head.encode() + faces + bytes(4) + points.astype(order + "f8").tobytes()


def pcd(points: NDArray[Any], encoding: str, kind: str = "f4") -> bytes:
    size = int(kind[1])
    n = len(points)
    head = "# .PCD v0.7\nVERSION 0.7\nFIELDS label x y z normal\n"
    head += f"SIZE 4 {size} {size} {size} 4\nTYPE U F F F F\nCOUNT 1 1 1 1 3\nWIDTH {n}\nHEIGHT 1\n"
    head += f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {encoding}\n"
    if encoding == "ascii":
        body = "".join(f"7 {x!r}  {y!r}\t{z!r} 0 0 1\n" for x, y, z in points.tolist()).encode()
        return head.encode() + body
    if encoding == "binary":
        record = np.dtype([("label", "<u4"), ("xyz", f"<{kind}", 3), ("normal", "<f4", 3)])
        table = np.zeros(n, record)
        table["xyz"] = points
        return head.encode() + table.tobytes()
    raw = bytes(4 * n) + points.T.astype(f"<{kind}").tobytes() + bytes(12 * n)
    packed = compress(raw)
    return head.encode() + struct.pack("<II", len(packed), len(raw)) + packed


def las(
    points: NDArray[Any],
    *,
    compress: bool = False,
    point_format: int = 0,
    version: str = "1.2",
    scale: float = 0.001,
    wkt: str = "",
    geokeys: dict[int, int] | None = None,
) -> bytes:
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales = np.full(3, scale)
    header.offsets = np.floor(points.min(axis=0))
    if wkt:
        header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "", wkt.encode() + b"\0"))
    if geokeys:
        rows = [(1, 1, 0, len(geokeys)), *((k, 0, 1, v) for k, v in sorted(geokeys.items()))]
        packed = struct.pack(f"<{4 * len(rows)}H", *(number for row in rows for number in row))
        header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "", packed))
    cloud = laspy.LasData(header)
    cloud.xyz = points
    stream = BytesIO()
    cloud.write(stream, do_compress=compress)
    return stream.getvalue()


def npy(array: NDArray[Any]) -> bytes:
    stream = BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def npz(**arrays: NDArray[Any]) -> bytes:
    stream = BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]
    return stream.getvalue()


def text(points: NDArray[Any], separator: str = " ") -> bytes:
    return "".join(separator.join(map(repr, row)) + "\n" for row in points.tolist()).encode()


VALID = {
    "ascii.ply": ply_ascii(POINTS),
    "little.ply": ply(POINTS),
    "big.ply": ply(POINTS, ">", ("float", "double", "float"), "zyx"),
    "faces.ply": ply_faces_first(POINTS),
    "faces_big.ply": ply_faces_first(POINTS, ">"),
    "ascii.pcd": pcd(POINTS, "ascii"),
    "binary.pcd": pcd(POINTS, "binary", "f8"),
    "compressed.pcd": pcd(POINTS, "binary_compressed"),
    "cloud.npy": npy(POINTS.astype(np.float32)),
    "cloud.npz": npz(points=POINTS),
    "cloud.xyz": text(POINTS),
    "cloud.csv": b"x,y,z\n" + text(POINTS, ","),
    "cloud.pts": b"5\n" + text(POINTS),
    "cloud.ptx": ptx(POINTS),
    "cloud.e57": e57((cartesian(POINTS[:2]), None), (cartesian(POINTS[2:]), None)),
}
"""Files that hold POINTS."""

IN_METRES = (".ptx", ".e57")
"""Formats whose numbers are metres by definition."""

VALID_LAS = {
    "cloud.las": las(FINITE),
    "cloud.laz": las(FINITE, compress=True),
    "layered.laz": las(FINITE, compress=True, point_format=7, version="1.4"),
}
"""Files that hold FINITE."""

UTM = np.array([432_000.0, 5_391_000.0, 120.0])


def read(folder: Path, name: str, data: bytes, **options: Any) -> dio.Scan:  # noqa: ANN401
    path = folder / name
    path.write_bytes(data)
    return dio.read(path, **options)


def refused(folder: Path, name: str, data: bytes, **options: Any) -> str:  # noqa: ANN401
    with pytest.raises(DivespotError) as caught:
        read(folder, name, data, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def raster(spacing: float, size: int) -> NDArray[np.float64]:
    x, y = np.meshgrid(np.arange(size) * spacing, np.arange(size) * spacing)
    middle = spacing * size / 2
    z = np.clip(0.5 * middle - 0.6 * np.hypot(x - middle, y - middle), 0, None)
    return np.column_stack([x.ravel(), y.ravel(), z.ravel() + 0.0123 * spacing * np.sin(x.ravel())])
