"""Files that are not what they seem: read right, or refused in one sentence of what to do."""

from __future__ import annotations

import gzip
import struct
import zipfile
from io import BytesIO
from typing import TYPE_CHECKING

import laspy
import numpy as np
import pytest

from divespot import DivespotError
from divespot import io as dio
from io_samples import POINTS, UTM, VALID, VALID_LAS, npy, npz, pcd, ply, raster, read, refused

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

ROWS = [[1.5, 2.25, 3.125], [4.5, 5.5, 6.5]]


# Tables of text


@pytest.mark.parametrize(
    "header",
    [
        "x,y,z",
        "POINT_X,POINT_Y,POINT_Z",
        "xcoord,ycoord,zcoord",
        "X Coordinate,Y Coordinate,Z Coordinate",
        "Rechtswert,Hochwert,Höhe",
        "Easting,Northing,Elevation",
        "E,N,Z",
    ],
)
def test_many_names_of_x_y_z(tmp_path: Path, header: str) -> None:
    body = "1.5,2.25,3.125\n4.5,5.5,6.5\n"
    scan = read(tmp_path, "a.csv", f"{header}\n{body}".encode())
    np.testing.assert_array_equal(scan.points, ROWS)
    assert scan.warnings == ()


def test_northing_first(tmp_path: Path) -> None:
    scan = read(tmp_path, "a.csv", b"N,E,Z\n2.25,1.5,3.125\n5.5,4.5,6.5\n")
    np.testing.assert_array_equal(scan.points, ROWS)


def test_a_quoted_comma_is_a_decimal_sign(tmp_path: Path) -> None:
    data = b'"x","y","z"\n"1,5","2,25","3,125"\n"4,5","5,5","6,5"\n'
    np.testing.assert_array_equal(read(tmp_path, "a.csv", data).points, ROWS)


def test_a_quoted_comma_parts_no_columns(tmp_path: Path) -> None:
    data = b'name,x,y,z\n"tree, old",1.5,2.25,3.125\n"b",4.5,5.5,6.5\n'
    np.testing.assert_array_equal(read(tmp_path, "a.csv", data).points, ROWS)


@pytest.mark.parametrize("rows", ["1,5,2,25,3,125\n", "1,2,3,4\n", "7,1,2,3,9\n"])
def test_a_header_of_another_width_is_refused(tmp_path: Path, rows: str) -> None:
    assert "--columns" in refused(tmp_path, "a.csv", f"x,y,z\n{rows * 3}".encode())
    assert "names 2 columns" in refused(tmp_path, "a.csv", f"x,y\n{rows * 3}".encode())


def test_a_comma_at_the_end_is_no_column(tmp_path: Path) -> None:
    data = b"x,y,z\n1.5,2.25,3.125,\n4.5,5.5,6.5,\n"
    np.testing.assert_array_equal(read(tmp_path, "a.csv", data).points, ROWS)


@pytest.mark.parametrize(("unit", "name"), [("ft", "ft"), ("us-ft", "ftUS"), ("m", "metres")])
def test_units_of_columns(tmp_path: Path, unit: str, name: str) -> None:
    header = f"Easting_{name},Northing_{name},Elevation_{name}\n"
    scan = read(tmp_path, "a.csv", (header + "1,2,3\n").encode())
    assert (scan.unit, scan.unit_stated) == (unit, True)


def test_feet_for_heights_alone_are_refused(tmp_path: Path) -> None:
    data = b"Easting,Northing,Elevation_ft\n1,2,3\n"
    assert "z is in ft" in refused(tmp_path, "a.csv", data)
    assert read(tmp_path, "a.csv", data, unit="ft").unit == "ft"


def point_list(order: tuple[int, int, int], offset: NDArray[np.float64]) -> bytes:
    points = raster(0.5, 12) + offset
    rows = (
        f"{i},{p[order[0]]:.3f},{p[order[1]]:.3f},{p[2]:.3f},GS\n" for i, p in enumerate(points)
    )
    return "".join(rows).encode()


def test_point_number_northing_easting_elevation(tmp_path: Path) -> None:
    for order, offset in (((1, 0, 2), UTM), ((1, 0, 2), 0 * UTM), ((0, 1, 2), UTM)):
        scan = read(tmp_path, "a.csv", point_list(order, offset))
        np.testing.assert_allclose(scan.points, raster(0.5, 12) + offset, atol=6e-4)
        assert "--columns" in scan.warnings[0]


def test_a_profile_that_counts_in_x_is_no_point_list(tmp_path: Path) -> None:
    data = "".join(f"{i // 4} {i % 4} {i} 7\n" for i in range(40)).encode()
    assert read(tmp_path, "a.xyz", data).points[:, 0].tolist() == [i // 4 for i in range(40)]


@pytest.mark.parametrize("columns", ["4,2,3", "far,up,3"])
def test_columns_as_asked(tmp_path: Path, columns: str) -> None:
    data = b"id;up;z;far\n9;2.25;3.125;1.5\n9;5.5;6.5;4.5\n"
    scan = read(tmp_path, "a.csv", data, columns=columns)
    np.testing.assert_array_equal(scan.points, ROWS)


@pytest.mark.parametrize("columns", ["1,2", "1,2,9", "1,2,nope", "0,1,2", ",,", "x"])
def test_columns_that_are_not_there(tmp_path: Path, columns: str) -> None:
    assert "columns" in refused(tmp_path, "a.csv", b"x,y,z\n1,2,3\n", columns=columns)


def test_columns_of_what_is_no_table(tmp_path: Path) -> None:
    for name, data in (VALID_LAS | VALID).items():
        if not name.endswith((".xyz", ".csv", ".pts")):
            assert "no table of text" in refused(tmp_path, name, data, columns="1,2,3")


@pytest.mark.parametrize(
    "nan",
    [
        "nan",
        "-nan",
        "NaN",
        "nan(ind)",
        "-nan(ind)",
        "nan(snan)",
        "1.#QNAN",
        "-1.#IND00",
        "nan(0x8)",
    ],
)
def test_every_printf_has_its_own_nan(tmp_path: Path, nan: str) -> None:
    scan = read(tmp_path, "a.xyz", f"1.5 2.25 3.125\n0 0 {nan}\n".encode())
    np.testing.assert_array_equal(scan.points, [ROWS[0], [0, 0, np.nan]])
    scan = read(tmp_path, "b.xyz", f"1.5 2.25 3.125\n0 0 {nan}\n1 1 -1.#INF\n".encode())
    assert scan.points[2, 2] == -np.inf


@pytest.mark.parametrize("names", ["lon,lat,height", "Longitude,Latitude,Altitude"])
def test_degrees_by_name(tmp_path: Path, names: str) -> None:
    assert "degrees" in refused(tmp_path, "a.csv", f"{names}\n8.1,48.2,300\n".encode())


def test_degrees_by_their_numbers(tmp_path: Path) -> None:
    points = raster(0.5, 30) * [1 / 74_000, 1 / 111_000, 1] + [8.1, 48.2, 300]
    assert "degrees" in refused(tmp_path, "a.npy", npy(points))
    assert len(read(tmp_path, "a.npy", npy(points), unit="m").points) == 900


# Arrays


def test_fields_in_capitals(tmp_path: Path) -> None:
    record = np.zeros(len(POINTS), [(axis, "f8") for axis in ("Intensity", "X", "Y", "Z")])
    record["X"], record["Y"], record["Z"] = POINTS.T
    np.testing.assert_array_equal(read(tmp_path, "a.npy", npy(record)).points, POINTS)
    capitals = {"X": POINTS[:, 0], "Y": POINTS[:, 1], "Z": POINTS[:, 2]}
    np.testing.assert_array_equal(read(tmp_path, "a.npz", npz(**capitals)).points, POINTS)
    for encoding in ("ascii", "binary", "binary_compressed"):
        data = pcd(POINTS, encoding).replace(b"label x y z", b"label X Y Z")
        np.testing.assert_array_equal(read(tmp_path, "a.pcd", data).points, POINTS)
    for order in "<>":
        data = ply(POINTS, order)
        for axis in (b"x", b"y", b"z"):
            data = data.replace(b"double %b\n" % axis, b"double %b\n" % axis.upper())
        np.testing.assert_array_equal(read(tmp_path, "a.ply", data).points, POINTS)


@pytest.mark.parametrize("shape", [(480, 640), (24, 32), (100, 90)])
def test_a_depth_image_is_no_list_of_points(tmp_path: Path, shape: tuple[int, int]) -> None:
    depth = np.full(shape, 1500, np.uint16)
    for name, data in (("a.npy", npy(depth)), ("a.npz", npz(depth=depth))):
        assert "depth image" in refused(tmp_path, name, data)
    table = "\n".join(",".join(map(str, row)) for row in depth.tolist())
    assert "depth image" in refused(tmp_path, "a.csv", table.encode())


def test_a_picture_and_a_transposed_array(tmp_path: Path) -> None:
    assert "picture" in refused(tmp_path, "a.npy", npy(np.zeros((40, 50, 3), np.uint8)))
    assert "transposed" in refused(tmp_path, "a.npy", npy(np.zeros((3, 500))))


def test_fields_of_unequal_shape(tmp_path: Path) -> None:
    record = np.zeros(5, [("x", "f4", 3), ("y", "f4"), ("z", "f4")])
    assert "differ in size" in refused(tmp_path, "a.npy", npy(record))


# PLY and PCD


def test_ply_tokens_on_any_lines(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 2\n"
    head += "".join(f"property float {name}\n" for name in "xyzrgb")
    head += "element face 1\nproperty list uchar int i\nend_header\n"
    bodies = (
        "1.5 2.25 3.125\n7 7 7\n4.5 5.5 6.5\n7 7 7\n3 0 1 1\n",
        "1.5 2.25 3.125 7 7 7 4.5 5.5",
    )
    scan = read(tmp_path, "a.ply", (head + bodies[0]).encode())
    np.testing.assert_array_equal(scan.points, ROWS)
    assert "8 values" in refused(tmp_path, "b.ply", (head + bodies[1]).encode())


@pytest.mark.parametrize("name", ["ascii.ply", "little.ply", "ascii.pcd", "binary.pcd"])
def test_headers_with_bare_cr(tmp_path: Path, name: str) -> None:
    last = b"end_header\n" if name.endswith("ply") else b"\nDATA "
    at = VALID[name].index(last) + len(last)
    at = VALID[name].index(b"\n", at - 1) + 1
    head, body = VALID[name][:at], VALID[name][at:]
    if name.startswith("ascii"):
        body = body.replace(b"\n", b"\r")
    scan = read(tmp_path, name, head.replace(b"\n", b"\r") + body)
    np.testing.assert_array_equal(scan.points, POINTS)


@pytest.mark.parametrize("name", ["ascii.ply", "ascii.pcd"])
def test_headers_with_leading_blanks(tmp_path: Path, name: str) -> None:
    data = b"\n" + VALID[name].replace(b"\n", b"\n  ")
    np.testing.assert_array_equal(read(tmp_path, name, data).points, POINTS)


@pytest.mark.parametrize("size", [b"WIDTH 2\nHEIGHT 1\n", b"POINTS 2\n", b"WIDTH 2\n"])
def test_pcd_of_version_5(tmp_path: Path, size: bytes) -> None:
    data = b"# .PCD v.5\nVERSION .5\nCOLUMNS x y z\n" + size + b"DATA ascii\n"
    rows = b"1.5 2.25 3.125\n4.5 5.5 6.5\n"
    np.testing.assert_array_equal(read(tmp_path, "a.pcd", data + rows).points, ROWS)


@pytest.mark.parametrize("count", [10**20, 2 * 10**8])
@pytest.mark.parametrize("encoding", ["ascii", "binary", "binary_compressed"])
def test_pcd_counts_beyond_the_file(tmp_path: Path, count: int, encoding: str) -> None:
    data = pcd(POINTS, encoding).replace(b"COUNT 1 1 1 1 3", b"COUNT 1 1 1 1 %d" % count)
    refused(tmp_path, "a.pcd", data)
    none = data.replace(b"WIDTH 5", b"WIDTH 0").replace(b"POINTS 5", b"POINTS 0")
    assert "0 points" in refused(tmp_path, "a.pcd", none)


# Packed


def zipped(**members: bytes) -> bytes:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name.replace("_", ".", 1), data)
    return stream.getvalue()


@pytest.mark.parametrize("name", VALID)
def test_gzip_and_zip_of_any_format(tmp_path: Path, name: str) -> None:
    for outer, data in (
        (f"{name}.gz", gzip.compress(VALID[name])),
        (f"{name}.gz", gzip.compress(VALID[name][:9]) + gzip.compress(VALID[name][9:])),
        ("a.zip", zipped(**{name.replace(".", "_"): VALID[name]})),
    ):
        scan = read(tmp_path, outer, data)
        np.testing.assert_array_equal(scan.points, POINTS)
        assert scan.warnings == ()


def test_packed_files_that_are_refused(tmp_path: Path) -> None:
    two = zipped(a_ply=VALID["little.ply"], b_ply=VALID["little.ply"])
    assert "holds 2 files" in refused(tmp_path, "a.zip", two)
    packed = gzip.compress(VALID["little.ply"])
    for cut in (packed[:-20], packed[:15]):
        assert "GZIP" in refused(tmp_path, "a.ply.gz", cut)
    bomb = gzip.compress(bytes(300 << 20))
    assert "over 100 times" in refused(tmp_path, "a.ply.gz", bomb)


def npz_packed_by(method: int) -> bytes:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        archive.writestr("points.npy", npy(POINTS))
    return stream.getvalue()


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA, zipfile.ZIP_STORED])
def test_npz_by_any_method_and_corrupt(tmp_path: Path, method: int) -> None:
    data = npz_packed_by(method)
    np.testing.assert_array_equal(read(tmp_path, "a.npz", data).points, POINTS)
    for at in range(40, len(data), 7):
        changed = data[:at] + bytes([data[at] ^ 0x55]) + data[at + 1 :]
        path = tmp_path / "b.npz"
        path.write_bytes(changed)
        try:
            dio.read(path)
        except DivespotError:
            continue


def test_npz_that_would_become_huge(tmp_path: Path) -> None:
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("points.npy", npy(np.zeros((12_000_000, 3))))
    assert "would unpack to 274 MB" in refused(tmp_path, "a.npz", stream.getvalue())


# LAS


def classified(*, version: str = "1.4", point_format: int = 6, compress: bool = False) -> bytes:
    header = laspy.LasHeader(point_format=point_format, version=version)
    header.scales, header.offsets = np.full(3, 0.001), np.zeros(3)
    cloud = laspy.LasData(header)
    cloud.xyz = np.column_stack([np.arange(8.0)] * 3)
    cloud.classification = np.array([2, 2, 7, 18, 6, 2, 1, 2], np.uint8)
    cloud.withheld = np.array([0, 0, 0, 0, 0, 1, 0, 0], np.uint8)
    cloud.return_number = np.array([1, 2, 1, 1, 1, 1, 2, 1], np.uint8)
    cloud.number_of_returns = np.array([2, 2, 1, 1, 1, 1, 3, 1], np.uint8)
    stream = BytesIO()
    cloud.write(stream, do_compress=compress)
    return stream.getvalue()


@pytest.mark.parametrize(
    ("options", "kept"),
    [
        ({}, [0, 1, 4, 6, 7]),
        ({"classes": "2"}, [0, 1, 7]),
        ({"classes": "2, 7"}, [0, 1, 2, 7]),
        ({"returns": "first"}, [0, 4, 7]),
        ({"returns": "last"}, [1, 4, 7]),
        ({"classes": "2", "returns": "last"}, [1, 7]),
    ],
)
@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize(("version", "kind"), [("1.4", 6), ("1.2", 1)])
def test_classes_returns_and_flags(  # noqa: PLR0917
    tmp_path: Path,
    options: dict[str, str],
    kept: list[int],
    compress: bool,  # noqa: FBT001
    version: str,
    kind: int,
) -> None:
    data = classified(version=version, point_format=kind, compress=compress)
    scan = read(tmp_path, "a.las", data, **options)
    assert scan.points[:, 0].tolist() == kept
    counted = sum(int(text.split()[0]) for text in scan.warnings if "were left out" in text)
    assert counted == 8 - len(kept)


def test_classes_that_are_not_there(tmp_path: Path) -> None:
    assert "its classes are 1, 2, 6, 7" in refused(tmp_path, "a.las", classified(), classes="99")
    for classes in ("", "a", "2;3", "-1", "2222"):
        assert "numbers from 0 to 255" in refused(tmp_path, "a.las", classified(), classes=classes)
    scan = read(tmp_path, "a.npy", VALID["cloud.npy"], classes="2")
    assert scan.warnings == ("NPY has no classes and returns: all points were taken",)


def test_a_laz_without_chunks_is_called_so(tmp_path: Path) -> None:
    data = bytearray(VALID_LAS["cloud.laz"])
    at = data.index(b"laszip encoded") - 2 + 54
    struct.pack_into("<H", data, at, 1)
    assert "a file with chunks is needed" in refused(tmp_path, "a.laz", bytes(data))


def test_a_chunk_that_counts_otherwise_is_corrupt(tmp_path: Path) -> None:
    data = bytearray(VALID_LAS["layered.laz"])
    start = struct.unpack_from("<I", data, 96)[0]
    struct.pack_into("<I", data, start + 8 + 36, 3)
    assert "corrupt" in refused(tmp_path, "a.laz", bytes(data))


# COPC


def test_of_an_octree_only_what_is_cropped_is_read(
    real_scan: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = real_scan("lone-star.copc.laz")
    whole = dio.read(path).points
    middle = (whole.min(axis=0) + whole.max(axis=0)) / 2
    plan = (*(middle[:2] - 3.0), *(middle[:2] + 2.0))
    inside = (whole[:, :2] >= plan[:2]) & (whole[:, :2] <= plan[2:])
    some = dio.read(path, plan=plan).points
    rows = {tuple(row) for row in some.tolist()}
    assert rows >= {tuple(row) for row in whole[inside.all(axis=1)].tolist()}
    assert len(some) < len(whole) / 5
    assert len(dio.read(path, plan=(0, 0, 1, 1)).points) == len(whole)
    monkeypatch.setattr("divespot.io.copc.TIMES", 0)
    with pytest.raises(DivespotError, match="goes in circles"):
        dio.read(path, plan=plan)


def test_an_octree_whose_header_promises_more(
    real_scan: Callable[[str], Path], tmp_path: Path
) -> None:
    data = bytearray(real_scan("lone-star.copc.laz").read_bytes())
    data[247:255] = struct.pack("<Q", 2**56)
    for options in ({}, {"plan": (515_384.0, 4_918_360.0, 515_386.0, 4_918_362.0)}):
        assert "chunks hold 518862" in refused(tmp_path, "a.laz", bytes(data), **options)


def test_an_octree_that_lies(real_scan: Callable[[str], Path], tmp_path: Path) -> None:
    data = bytearray(real_scan("lone-star.copc.laz").read_bytes())
    # A node is its key, offset, bytes and points; the last of all is at the end.
    data[-4:] = struct.pack("<i", 50_000)
    plan = (515_368.0, 4_918_340.0, 515_402.0, 4_918_382.0)
    assert "disagree" in refused(tmp_path, "a.laz", bytes(data), plan=plan)


@pytest.mark.parametrize("plan", [(1, 2, 3), (1, 2, 3, np.nan), "1234x", 7, (1, 2, 3, "x")])
def test_a_plan_is_four_numbers(tmp_path: Path, plan: object) -> None:
    with pytest.raises(DivespotError, match="four numbers"):
        dio.read(tmp_path / "a.laz", plan=plan)  # type: ignore[arg-type]
