"""Meshes are measured as surfaces: a few triangles give the volume of the solid they bound."""

from __future__ import annotations

import json
import struct
import sys
import tracemalloc
from math import pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
import divespot.extras
from divespot import DivespotError
from divespot import io as dio
from io_samples import UTM, read, refused

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]

CORNERS, RADIUS_M, HEIGHT_M = 24, 0.5, 0.3
# A pyramid over a regular polygon.
VOLUME_M3 = CORNERS / 2 * RADIUS_M**2 * sin(2 * pi / CORNERS) * HEIGHT_M / 3


def cone(corners: int = CORNERS) -> Mesh:
    """Return a cone of few triangles in the middle of a floor of twice its radius."""
    turn = 2 * np.pi * np.arange(corners) / corners
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    vertices = np.vstack([[0, 0, HEIGHT_M], RADIUS_M * ring, 2.2 * RADIUS_M * ring])
    inner = 1 + np.arange(corners)
    following = 1 + (np.arange(corners) + 1) % corners
    faces = [
        np.column_stack([0 * inner, inner, following]),
        np.column_stack([inner, inner + corners, following]),
        np.column_stack([following, inner + corners, following + corners]),
    ]
    return vertices, np.vstack(faces)


def obj(mesh: Mesh) -> bytes:
    vertices, faces = mesh
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    return ("\n".join(lines) + "\n").encode()


def stl(mesh: Mesh) -> bytes:
    vertices, faces = mesh
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
    table = np.zeros(len(faces), kind)
    table["corners"] = vertices[faces]
    return bytes(80) + struct.pack("<I", len(faces)) + table.tobytes()


def stl_text(mesh: Mesh) -> bytes:
    vertices, faces = mesh
    parts = ["solid heap"]
    for triangle in vertices[faces].tolist():
        corners = "\n".join(f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle)
        parts.append(f"facet normal 0 0 1\nouter loop\n{corners}\nendloop\nendfacet")
    return ("\n".join([*parts, "endsolid heap"]) + "\n").encode()


def ply(mesh: Mesh, *, binary: bool = True) -> bytes:
    vertices, faces = mesh
    name = "binary_little_endian" if binary else "ascii"
    head = f"ply\nformat {name} 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    if not binary:
        rows = [" ".join(map(repr, row)) for row in vertices.tolist()]
        rows += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
        return (head + "\n".join(rows) + "\n").encode()
    table = np.zeros(len(faces), [("n", "u1"), ("corners", "<i4", 3)])
    table["n"], table["corners"] = 3, faces
    return head.encode() + vertices.astype("<f8").tobytes() + table.tobytes()


def glb(mesh: Mesh, **changes: Any) -> bytes:  # noqa: ANN401 - any JSON value
    """Return a file whose only node is moved by 1 m along x."""
    vertices, faces = mesh[0].astype("<f4"), mesh[1].astype("<u4")
    body = vertices.tobytes() + faces.tobytes()
    low, high = vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()
    content: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [1.0, 0.0, 0.0]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"}
            | {"min": low, "max": high},
            {"bufferView": 1, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": vertices.nbytes},
            {"buffer": 0, "byteOffset": vertices.nbytes, "byteLength": faces.nbytes},
        ],
        "buffers": [{"byteLength": len(body)}],
        **changes,
    }
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


FILES = {
    "a.obj": obj(cone()),
    "a.stl": stl(cone()),
    "text.stl": stl_text(cone()),
    "a.ply": ply(cone()),
    "ascii.ply": ply(cone(), binary=False),
    "a.glb": glb(cone()),
}
needs_trimesh = pytest.mark.skipif(
    not divespot.extras.is_installed("trimesh"), reason="the extra mesh is not installed"
)


@needs_trimesh
@pytest.mark.parametrize("name", ["a.obj", "a.stl", "a.ply", "a.glb"])
def test_a_decimated_cone_has_its_volume(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(FILES[name])
    report = divespot.measure(path)
    (pile,) = report.piles
    assert pile.volume_m3 == pytest.approx(VOLUME_M3, rel=1e-4)
    assert abs(pile.volume_m3 - VOLUME_M3) < pile.u95_m3


@needs_trimesh
@pytest.mark.parametrize(("one", "other"), [("a.ply", "ascii.ply"), ("a.obj", "text.stl")])
def test_text_and_binary_hold_the_same(tmp_path: Path, one: str, other: str) -> None:
    first, second = (read(tmp_path, name, FILES[name]).points for name in (one, other))
    np.testing.assert_allclose(first, second, atol=1e-9)


@needs_trimesh
def test_points_lie_on_the_surface_evenly(tmp_path: Path) -> None:
    square = np.array([[0.0, 0, 1], [3, 0, 1], [3, 2, 1], [0, 2, 1]])
    scan = read(tmp_path, "a.obj", obj((square, np.array([[0, 1, 2], [0, 2, 3]]))))
    np.testing.assert_array_equal(scan.points[:, 2], 1.0)
    x, y, _ = scan.points.T
    counts, _, _ = np.histogram2d(x, y, bins=(30, 20), range=((0.0, 3.0), (0.0, 2.0)))
    expected = len(scan.points) / counts.size
    assert np.abs(counts / expected - 1.0).max() < 0.1


@needs_trimesh
def test_coordinates_of_a_survey_keep_their_digits(tmp_path: Path) -> None:
    vertices, faces = cone()
    path = tmp_path / "a.ply"
    path.write_bytes(ply((vertices + UTM, faces)))
    assert divespot.measure(path).total.volume_m3 == pytest.approx(VOLUME_M3, rel=1e-4)


@needs_trimesh
def test_the_parts_of_a_glb_are_where_it_puts_them(tmp_path: Path) -> None:
    scan = read(tmp_path, "a.glb", FILES["a.glb"])
    assert scan.points[:, 0].mean() == pytest.approx(1.0, abs=1e-3)
    assert (scan.unit, scan.unit_stated) == ("m", True)


def test_a_cloud_beside_a_few_faces_is_a_cloud(tmp_path: Path) -> None:
    vertices, faces = cone()
    scan = read(tmp_path, "a.ply", ply((vertices, faces[:20])))
    np.testing.assert_array_equal(scan.points, vertices)


def test_without_trimesh_a_ply_has_vertices(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "trimesh", None)
    scan = read(tmp_path, "a.ply", FILES["a.ply"])
    np.testing.assert_array_equal(scan.points, cone()[0])
    assert "pip install divespot[mesh]" in scan.warnings[0]
    assert "pip install divespot[mesh]" in refused(tmp_path, "a.stl", FILES["a.stl"])


def lying(name: str) -> bytes:
    data = FILES[name]
    if name == "a.stl":
        return data[:80] + struct.pack("<I", 80_000_000) + data[84:]
    if name == "a.glb":
        return glb(cone(), accessors=[{"componentType": 5126, "count": 10**9, "type": "VEC3"}])
    return data.replace(b"face %d" % len(cone()[1]), b"face 800000000")


@needs_trimesh
@pytest.mark.parametrize("name", ["a.stl", "a.glb", "a.ply", "ascii.ply"])
def test_counts_that_lie(tmp_path: Path, name: str) -> None:
    tracemalloc.start()
    said = refused(tmp_path, name, lying(name))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert "promises" in said
    assert peak < 64 << 20


@needs_trimesh
@pytest.mark.parametrize("name", FILES)
def test_files_that_are_cut_off(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    for size in range(1, len(FILES[name]) - 1, 211):
        path.write_bytes(FILES[name][:size])
        try:
            dio.read(path)
        except DivespotError as err:
            assert str(err).startswith(str(path))  # noqa: PT017 - text may be cut between lines


@needs_trimesh
@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "no triangles|not a readable mesh"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "not a readable mesh"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "no area"),
        ("a.obj", b"hello\n", "no triangles|not a readable mesh"),
        ("a.stl", bytes(80) + b"\0\0\0\0", "no triangles|not a readable mesh"),
        ("a.stl", b"short", "no STL file inside"),
        ("a.glb", b"glTF", "not a readable GLB"),
        ("a.glb", glb(cone(), meshes=[]), "no triangles|not a readable mesh"),
        ("a.ply", ply((cone()[0], cone()[1] + 900)), "not a readable mesh"),
    ],
)
def test_bad_meshes(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(DivespotError, match=words):
        dio.read(path)
