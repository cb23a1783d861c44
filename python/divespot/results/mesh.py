"""Piles as closed meshes: their surface, and the base below it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot._arguments import require_kind
from divespot.io.write import MARK
from divespot.output import other_ending, refuse_inputs, whole
from divespot.report import Report
from divespot.results.drawn_fill import filled
from divespot.results.pile_matching import labels

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

#: Rows and columns of the corners of the two triangles in a square of nodes, counter-clockwise as
#: seen from above.
_HALVES = (((0, 0), (0, 1), (1, 1)), ((0, 0), (1, 1), (1, 0)))

_FACE = np.dtype([("count", "u1"), ("nodes", "<i4", 3), ("pile", "<u2")])


def save_mesh(report: Report, path: str | os.PathLike[str]) -> None:
    """Write a closed mesh of each pile as PLY, in the scan's own frame and unit.

    Each face has the number of its pile. The top is the surface at the middle of each cell, and
    meets the base one cell outside the pile, so that the mesh holds the cells' heights above the
    base times their area. Unseen cells are interpolated for drawing, so that the volume there may
    differ from the report's.

    Raises
    ------
    DivespotError
        The report is from JSON, the ending is not ``.ply``, or the file cannot be written.

    """
    require_kind("report", report, Report)
    if not str(path).lower().endswith(".ply"):
        raise other_ending(path, "a mesh", (".ply",))
    refuse_inputs(path, "the mesh", report.inputs)
    nodes, faces = mesh(report)
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment {MARK}\nelement vertex {len(nodes)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\n"
        "property list uchar int vertex_indices\nproperty ushort pile\nend_header\n"
    )
    with whole(path) as stream:
        stream.write(header.encode() + nodes.astype("<f8").tobytes() + faces.tobytes())


def mesh(report: Report) -> tuple[NDArray[np.float64], NDArray[np.void]]:
    """Return the nodes, shape ``(n, 3)``, and the faces of all piles."""
    level = report.level
    pile = np.pad(labels(report.piles, level.frame, level), 1)
    maps = (level.height_map.heights_m, level.base_m)
    surface_m, base_m = (np.pad(filled(values), 1, mode="edge") for values in maps)
    nodes, faces, count = [np.empty((0, 3))], [np.empty(0, dtype=_FACE)], 0
    for item in report.piles:
        places, triangles = _closed(pile == item.id, surface_m, base_m)
        own = np.empty(len(triangles), dtype=_FACE)
        own["count"], own["nodes"], own["pile"] = 3, triangles + count, min(item.id, 65535)
        nodes.append(places)
        faces.append(own)
        count += len(places)
    at = np.concatenate(nodes)
    x0, y0 = level.height_map.origin_m
    # Row and column in the padded map, whose first cell is one before the map's.
    at[:, :2] = (at[:, :2] - 0.5) * level.height_map.cell_m + (x0, y0)
    return level.frame.to_scan(at), np.concatenate(faces)


def _closed(
    inside: NDArray[np.bool_], surface_m: NDArray[np.float64], base_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return column, row and height of the nodes, and the triangles between them."""
    row, column = np.nonzero(_squares(inside))
    around = np.zeros_like(inside)
    for down, right in ((0, 0), (0, 1), (1, 0), (1, 1)):
        around[row + down, column + right] = True
    # Nodes of the base are numbered first; at the rim, those of the top are the same.
    below = np.cumsum(around).reshape(around.shape) - 1
    above = np.where(inside, around.sum() + np.cumsum(inside).reshape(inside.shape) - 1, below)
    places = [
        np.column_stack([*np.nonzero(which)[::-1], heights[which]])
        for which, heights in ((around, base_m), (inside, surface_m))
    ]
    triangles = []
    for half in _HALVES:
        corners = [(row + down, column + right) for down, right in half]
        triangles.append(np.column_stack([above[at] for at in corners]))
        triangles.append(np.column_stack([below[at] for at in reversed(corners)]))
    return np.concatenate(places).astype(np.float64), _without_flat(np.concatenate(triangles))


def _squares(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the squares of four nodes with a corner in the pile, by their lower left node."""
    rows = inside[:-1] | inside[1:]
    return np.asarray(rows[:, :-1] | rows[:, 1:])


def _without_flat(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the faces without those where top and base coincide at the rim."""
    keys = np.sort(faces, axis=1)
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    return np.asarray(faces[np.sort(first[counts == 1])])
