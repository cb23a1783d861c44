"""Meshes (OBJ, STL, GLB, PLY with faces) as surfaces, through trimesh (the extra ``mesh``)."""

from __future__ import annotations

import json
import logging
import struct
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.extras import extra
from divespot.io.records import require_bytes
from divespot.io.scan import FloatArray, RawCloud

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

#: Number of points sampled on a surface: as many as a depth camera's frame has, or more for more
#: triangles, up to what takes two seconds to measure.
FEWEST, MOST = 400_000, 4_000_000

#: Meshes with more triangles are refused.
MOST_TRIANGLES = 50_000_000

#: Steps of the sequence R2 (M. Roberts, 2018), which fills a square evenly for any number of terms:
#: powers of 1 / 1.3247..., the root of x**3 = x + 1.
R2 = (0.7548776662466927, 0.5698402909980532)

_STL_HEAD, _STL_TRIANGLE = 84, 50
_GLB_HEAD = 20


def reader(kind: str, unit: str | None = None) -> Callable[[bytes], RawCloud]:
    """Return a reader for one of trimesh's formats."""

    def read(data: bytes) -> RawCloud:
        if kind in _CHECKS:
            _CHECKS[kind](data)
        return RawCloud(points_on(triangles_of(data, kind)), unit=unit)

    return read


def triangles_of(data: bytes, kind: str) -> FloatArray:
    """Return the corners of all triangles, shape (n, 3, 3), in the file's common frame.

    Raises
    ------
    DivespotError
        trimesh is missing or cannot read the file, or there are no triangles.

    """
    trimesh = extra("trimesh", "mesh", "a mesh needs trimesh")
    # trimesh's log messages would be printed if nobody handles them; its errors are raised anyway.
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    try:
        scene = trimesh.load_scene(
            BytesIO(data), file_type=kind, process=False, skip_materials=True
        )
        return _triangles(scene)
    except (DivespotError, MemoryError):
        raise
    # trimesh documents no exceptions.
    except Exception as err:  # noqa: BLE001
        name = type(err).__name__
        raise damaged(f"not a readable mesh ({name}: {err})") from None


def _triangles(scene: Any) -> FloatArray:  # noqa: ANN401 - trimesh's own types are loose
    placed = [scene.graph[name] for name in scene.graph.nodes_geometry]
    parts = [(matrix, scene.geometry[name]) for matrix, name in placed]
    parts = [(matrix, part) for matrix, part in parts if len(getattr(part, "faces", ()))]
    count = sum(len(part.faces) for _, part in parts)
    if count > MOST_TRIANGLES:
        raise DivespotError(f"it has {count} triangles: at most {MOST_TRIANGLES} are needed")
    if not parts:
        raise DivespotError("it holds no triangles: a mesh with faces is needed")
    corners = [
        (np.asarray(part.vertices) @ matrix[:3, :3].T + matrix[:3, 3])[part.faces]
        for matrix, part in parts
    ]
    return np.concatenate(corners)


def points_on(triangles: FloatArray) -> FloatArray:
    """Return points that are spread evenly over triangles, in proportion to their areas.

    Raises
    ------
    DivespotError
        The triangles have no area.

    """
    known = triangles[np.isfinite(triangles).all(axis=(1, 2))]
    sides = known[:, 1:] - known[:, :1]
    with np.errstate(over="ignore", invalid="ignore"):
        reached = np.cumsum(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1))
    if not (len(reached) and 0.0 < reached[-1] < np.inf):
        raise DivespotError("its triangles have no area: a surface is needed")
    count = min(max(FEWEST, len(known)), MOST)
    place = np.arange(count)
    at = np.searchsorted(reached, (place + 0.5) * (reached[-1] / count))
    at = np.minimum(at, len(known) - 1)
    along = _evenly(place)
    points: FloatArray = known[at, 0] + (along[:, :, None] * sides[at]).sum(axis=1)
    return points


def _evenly(place: NDArray[np.int64]) -> FloatArray:
    """Return fractions along two sides of a triangle, shape (n, 2), with sums of at most 1."""
    share = (0.5 + place[:, None] * np.array(R2)) % 1.0
    return np.asarray(np.where(share.sum(axis=1, keepdims=True) > 1.0, 1.0 - share, share))


def _check_stl(data: bytes) -> None:
    if not data.lstrip().startswith(b"solid"):
        (count,) = struct.unpack_from("<I", data, _STL_HEAD - 4)
        require_bytes(count * _STL_TRIANGLE, len(data) - _STL_HEAD, count)


def _check_glb(data: bytes) -> None:
    """Check the counts from which arrays are made, since their data need not be in the file."""
    try:
        (size,) = struct.unpack_from("<I", data, 12)
        parsed = json.loads(data[_GLB_HEAD : _GLB_HEAD + size])
        counts = [int(accessor["count"]) for accessor in parsed.get("accessors", [])]
    except (struct.error, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise damaged("not a readable GLB file (its JSON)") from None
    if sum(counts) > len(data):
        raise damaged(f"it promises {sum(counts)} values in {len(data)} bytes")


_CHECKS = {"stl": _check_stl, "glb": _check_glb}
