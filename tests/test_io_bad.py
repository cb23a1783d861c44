"""Bad files end in one clear line: never another exception, never memory for what is not there."""

from __future__ import annotations

import errno
import os
import pathlib
import struct
import tracemalloc
import zipfile
from io import BytesIO
from typing import TYPE_CHECKING
from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from divespot import DivespotError
from divespot import io as dio
from io_samples import FINITE, POINTS, VALID, VALID_LAS, las, npy, npz, pcd, ply

if TYPE_CHECKING:
    from pathlib import Path

    from divespot.io.scan import FloatArray

ALL = VALID | VALID_LAS
HUGE = 4_000_000_000
MAX_BYTES = 64 << 20


def read_or_refuse(path: Path, data: bytes) -> FloatArray | None:
    """Read, or return None on DivespotError of one line that names the file; all else fails."""
    path.write_bytes(data)
    try:
        scan = dio.read(path)
    except DivespotError as err:
        require_one_line(err, path)
        return None
    assert scan.points.ndim == 2
    assert scan.points.shape[1] == 3
    assert len(scan.points) > 0
    return scan.points


def require_one_line(err: DivespotError, path: Path) -> None:
    assert str(err).startswith(f"{path}: ")
    assert "\n" not in str(err)


def refuses(path: Path, data: bytes, words: str) -> None:
    path.write_bytes(data)
    with pytest.raises(DivespotError, match=words) as caught:
        dio.read(path)
    require_one_line(caught.value, path)


def test_no_file_a_folder_a_pipe_no_path(tmp_path: Path) -> None:
    with pytest.raises(DivespotError, match="No such file"):
        dio.read(tmp_path / "none.ply")
    with pytest.raises(DivespotError, match="is a folder"):
        dio.read(tmp_path)
    os.mkfifo(tmp_path / "pipe.ply")
    with pytest.raises(DivespotError, match="no regular file"):
        dio.read(tmp_path / "pipe.ply")
    with pytest.raises(DivespotError, match="is no path"):
        dio.read("a\0b.ply")
    with pytest.raises(DivespotError, match="cannot be read"):
        dio.read(tmp_path / ("n" * 5000))


def test_no_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(VALID["little.ply"])
    # Not by chmod: root, under whom containers run tests, may read everything.
    denied = PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    monkeypatch.setattr(pathlib.Path, "read_bytes", Mock(side_effect=denied))
    with pytest.raises(DivespotError, match="Permission denied"):
        dio.read(path)


@pytest.mark.parametrize("name", ALL)
def test_empty_file(tmp_path: Path, name: str) -> None:
    refuses(tmp_path / name, b"", "the file is empty")


NONE = np.empty((0, 3))


def ply_text(body: str, *properties: str) -> bytes:
    head = "ply\nformat ascii 1.0\nelement vertex 2\n"
    head += "".join(f"property {p}\n" for p in properties or ("float x", "float y", "float z"))
    return (head + "end_header\n" + body).encode()


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", ply(NONE)),
        ("b.ply", ply_text("").replace(b"vertex 2", b"vertex 0")),
        ("a.pcd", pcd(NONE, "binary")),
        ("b.pcd", pcd(NONE, "ascii")),
        ("a.npy", npy(NONE)),
        ("a.npz", npz(points=NONE)),
    ],
)  # fmt: skip
def test_zero_points(tmp_path: Path, name: str, data: bytes) -> None:
    refuses(tmp_path / name, data, "it holds 0 points")


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_zero_points_in_las(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    dio.write(path, NONE)
    with pytest.raises(DivespotError, match="it holds 0 points"):
        dio.read(path)


PCD_3 = (
    b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n"
)
NPY_OBJECT = BytesIO()
np.save(NPY_OBJECT, np.array([{"a": 1}, None]), allow_pickle=True)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        # PLY
        ("a.ply", ply_text("1 2\n3 4\n", "float x", "float y"), "no z among its vertex properties"),
        ("a.ply", ply_text("1 2 3\n"), "promises 2 points but the file holds 1 rows"),
        ("a.ply", ply_text("1 2 3\n4 5\n"), "line 9 has 2 fields where line 8 has 3"),
        ("a.ply", ply_text("1 2 3\n4 x 6\n"), "line 9 is '4 x 6': a number in field 2 is needed"),
        ("a.ply", ply_text("1 2 3 4\n4 5 6 7\n"), "line 8 has 4 values"),
        ("a.ply", ply_text("1 1\n", "float x", "float y", "float z", "list int int q"), "list p"),
        ("a.ply", ply_text("", "complex x"), "PLY header line 4"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 2\n", "end_header"),
        ("a.ply", b"ply\nformat ascii 1.0\nend_header\n", "no 'vertex'"),
        ("a.ply", b"ply\nelement vertex 1\nproperty float x\nend_header\n", "no 'format'"),
        ("a.ply", b"ply\nproperty float x\nend_header\n", "header line 2"),
        ("a.ply", b"ply\nelement vertex -1\nend_header\n", "header line 2"),
        ("a.ply", VALID["little.ply"][:-1], "promises 5 points .125 bytes. but the file holds 124"),
        ("a.ply", VALID["faces.ply"].split(b"end_header\n")[0] + b"end_header\n\3", "truncated"),
        # PCD
        ("a.pcd", PCD_3 + b"1 2 3\n", "promises 2 points but the file holds 1 rows"),
        ("a.pcd", PCD_3 + b"1 2 3\n1 2 z\n", "line 10 is '1 2 z': a number in field 3 is needed"),
        ("a.pcd", PCD_3.replace(b"x y z", b"x y i") + b"1 2 3\n4 5 6\n", "no z among its PCD"),
        ("a.pcd", PCD_3.replace(b"POINTS 2", b"POINTS 3"), "POINTS 3 but WIDTH x HEIGHT 2"),
        ("a.pcd", PCD_3.replace(b"ascii", b"morse"), "'morse': one of ascii"),
        ("a.pcd", PCD_3.replace(b"TYPE F F F", b"TYPE F F"), "of one length"),
        ("a.pcd", PCD_3.replace(b"TYPE F F F", b"TYPE F F Q"), "TYPE Q SIZE 4"),
        ("a.pcd", PCD_3.replace(b"DATA ascii\n", b""), "no DATA line"),
        ("a.pcd", VALID["binary.pcd"][:-1], "truncated or corrupt"),
        ("a.pcd", VALID["compressed.pcd"][:-1], "truncated or corrupt"),
        ("a.pcd", VALID["compressed.pcd"][:-20] + b"\xff" * 20, "data refer back"),
        # LAS
        ("a.las", VALID_LAS["cloud.las"][:-1], "4 points .80 bytes. but the file holds 79"),
        ("a.las", VALID_LAS["cloud.las"][:100], "ends inside its header"),
        ("a.laz", VALID_LAS["cloud.laz"][:-30], "truncated"),
        ("a.laz", VALID_LAS["cloud.las"].replace(b"LASF", b"LASX"), "no LAS/LAZ file inside"),
        # Text
        ("a.xyz", b"1 2 3\n4 5\n", "line 2 has 2 fields where line 1 has 3"),
        ("a.xyz", b"# c\n\n1 2 3\n4 5 6 7\n", "line 4 has 4 fields where line 3 has 3"),
        ("a.csv", b"x,y,z\n1,2,3\n4,,6\n", "line 3 is '4,,6': a number in field 2 is needed"),
        ("a.csv", b"x,y,intensity\n1,2,3\n", "names some of x, y, z"),
        ("a.csv", b"x_mm,y_m,z_m\n1,2,3\n", "different units"),
        ("a.txt", b"hello\nthere is nothing here\n", "no line has three numbers"),
        ("a.txt", b"1 2\n3 4\n", "no line has three numbers"),
        ("a.txt", b"\n\n", "no line has three numbers"),
        ("a.pts", b"3\n1 2 3\n4 5 6\n", "promises 3 points but 2 rows"),
        ("a.asc", b"ncols 3\nnrows 1\nxllcorner 0\n1 2 3\n", "ESRI grid"),
        # NPY, NPZ
        ("a.npy", NPY_OBJECT.getvalue(), "pickled"),
        ("a.npy", npy(POINTS.astype(complex)), "complex128 values"),
        ("a.npy", npy(POINTS.astype(str)), "real numbers are needed"),
        ("a.npy", npy(POINTS > 0), "bool values"),
        ("a.npy", npy(POINTS[:, :2]), r"shape \(5, 2\): shape"),
        ("a.npy", npy(POINTS[:, 0]), r"shape \(5,\): shape"),
        ("a.npy", npy(np.zeros((2, 2, 2, 3))), "need"),
        ("a.npy", npy(np.zeros(3, [("x", "f4"), ("y", "f4")])), "no z among its fields"),
        ("a.npy", VALID["cloud.npy"][:-1], "truncated or corrupt"),
        ("a.npz", VALID["cloud.npz"][:-1], "truncated or corrupt"),
        ("a.npz", npz(a=POINTS, b=POINTS), "arrays a, b: one array"),
        ("a.npz", npz(x=POINTS[0], y=POINTS[0], z=POINTS[0, :1]), "differ in size"),
        # Names
        ("a.ply", b"1 2 3\n", "no PLY file inside: one of PLY"),
        ("a.json", b"{}", "no known format: one of PLY"),
        ("a.txt", bytes(range(256)), "no text file inside"),
        ("nothing", b"\x89HDF\r\n", "no known format"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    refuses(tmp_path / name, data, words)


def test_unknown_unit(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    path.write_bytes(VALID["cloud.npy"])
    with pytest.raises(DivespotError, match="unit is 'furlong': one of auto, m, dm"):
        dio.read(path, unit="furlong")


def las_promising(count: int, *, compress: bool) -> bytes:
    data = bytearray(las(FINITE, compress=compress, point_format=6, version="1.4"))
    struct.pack_into("<Q", data, 247, count)
    return bytes(data)


def npz_bomb() -> bytes:
    """Return an archive whose member's header promises what the member does not hold."""
    stream = BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("points.npy", npy(POINTS).replace(b"(5, 3), }", b"(4000000000, 3), }"))
    return stream.getvalue()


def pcd_lzf_bomb() -> bytes:
    data = pcd(POINTS, "binary_compressed").replace(b"WIDTH 5", b"WIDTH 100000000")
    head, body = data.replace(b"POINTS 5", b"POINTS 100000000").split(b"compressed\n")
    sizes = struct.pack("<II", len(body) - 8, 2_800_000_000)
    return head + b"compressed\n" + sizes + body[8:]


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", VALID["little.ply"].replace(b"vertex 5", b"vertex %d" % HUGE)),
        ("b.ply", VALID["ascii.ply"].replace(b"vertex 5", b"vertex %d" % HUGE)),
        ("c.ply", VALID["faces.ply"].replace(b"face 2", b"face %d" % HUGE)),
        ("a.pcd", VALID["binary.pcd"].replace(b" 5\n", b" %d\n" % HUGE)),
        ("b.pcd", VALID["compressed.pcd"].replace(b" 5\n", b" %d\n" % HUGE)),
        ("c.pcd", pcd_lzf_bomb()),
        ("d.pcd", VALID["binary.pcd"].replace(b"COUNT 1", b"COUNT %d" % HUGE)),
        ("a.las", las_promising(HUGE, compress=False)),
        ("a.laz", las_promising(HUGE, compress=True)),
        ("a.npy", npy(POINTS).replace(b"(5, 3), }", b"(4000000000, 3), }")),
        ("a.npz", npz_bomb()),
        ("a.pts", b"%d\n1 2 3\n" % HUGE),
    ],
)
def test_no_memory_for_what_is_not_there(tmp_path: Path, name: str, data: bytes) -> None:
    tracemalloc.start()
    refuses(tmp_path / name, data, "promise|disagree|truncated|corrupt|inside")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # One batch of LAZ records is the largest allowance.
    assert peak < MAX_BYTES


@pytest.mark.parametrize("name", ALL)
def test_cut_off_anywhere(tmp_path: Path, name: str) -> None:
    data = ALL[name]
    path = tmp_path / name
    expected = POINTS if name in VALID else FINITE
    for size in range(len(data)):
        points = read_or_refuse(path, data[:size])
        if points is None or name.endswith((".xyz", ".csv")):
            continue
        # A cut may fall behind the last point, or, in text, inside its last number.
        np.testing.assert_array_equal(points[:-1], expected[:-1])


@pytest.mark.parametrize("name", ALL)
@given(st.lists(st.tuples(st.integers(0, 1 << 16), st.integers(0, 255)), min_size=1, max_size=4))
@settings(max_examples=60, deadline=None)
def test_random_bytes_flipped(
    tmp_path_factory: pytest.TempPathFactory, name: str, flips: list[tuple[int, int]]
) -> None:
    data = bytearray(ALL[name])
    for place, value in flips:
        data[place % len(data)] = value
    read_or_refuse(tmp_path_factory.getbasetemp() / name, bytes(data))


@given(st.binary(max_size=200), st.sampled_from(sorted(ALL)), st.integers(0, 300))
@settings(max_examples=60, deadline=None)
def test_garbage_after_a_good_beginning(
    tmp_path_factory: pytest.TempPathFactory, tail: bytes, name: str, keep: int
) -> None:
    read_or_refuse(tmp_path_factory.getbasetemp() / name, ALL[name][:keep] + tail)


# Writing


@pytest.mark.parametrize(
    ("name", "points", "words"),
    [
        ("a.ply", np.zeros((3, 2)), r"float64 of shape \(3, 2\)"),
        ("a.ply", np.zeros((3, 3), complex), "complex128"),
        ("a.stl", POINTS, "one of .ply, .npy, .xyz, .las, .laz is needed"),
        ("none/a.npy", POINTS, "cannot be written"),
        ("a.las", POINTS, "cannot hold nan"),
        ("a.laz", np.array([[0, 0, 0], [1e6, 0, 0]]), "span 1000000 m: at most 214748 m"),
    ],
)
def test_what_cannot_be_written(tmp_path: Path, name: str, points: FloatArray, words: str) -> None:
    with pytest.raises(DivespotError, match=words):
        dio.write(tmp_path / name, points)
