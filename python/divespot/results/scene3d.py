"""Data for the 3D view of a report, drawn by Plotly."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot import _native
from divespot.results.drawn_fill import filled, thinned
from divespot.results.show_units import Shown

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.report import Report

#: Cells along the longer side of the view, which keeps its data below a megabyte.
MOST_CELLS = 180


def scene(report: Report) -> dict[str, Any]:
    """Return heights, base, and for each cell its pile and whether it was seen.

    Positions are in metres in the level frame from the corner of its map; heights are above the
    ground. Unseen cells have a height only within piles.
    """
    level = report.level
    grid = level.height_map
    step = -(-max(grid.heights_m.shape) // MOST_CELLS)
    seen = thinned(grid.heights_m, step)
    whole = thinned(filled(grid.heights_m), step)
    cell_m = grid.cell_m * step
    rows, columns = seen.shape
    x, y = (np.arange(size) + 0.5 for size in (columns, rows))
    pile = _piles(report, x * cell_m, y * cell_m)
    heights = np.where(pile > 0, whole, seen) - level.ground_m
    base = np.where(pile > 0, thinned(filled(level.base_m), step), np.nan) - level.ground_m
    return {
        "x": [round(v, 5) for v in (x * cell_m).tolist()],
        "y": [round(v, 5) for v in (y * cell_m).tolist()],
        "z": _packed(heights, np.float32),
        "base": _packed(base, np.float32),
        "pile": _packed(pile, np.uint8),
        "filled": _packed((pile > 0) & np.isnan(seen), np.uint8),
        "top": float(np.nanmax(heights, initial=cell_m)),
        "piles": len(report.piles),
        "labels": _labels(report, pile, heights, (x * cell_m, y * cell_m)),
    }


def _piles(report: Report, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the number of the pile that each cell belongs to, 0 for none, at most 255."""
    at = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2) + report.level.height_map.origin_m
    found = np.zeros(len(at), dtype=np.int64)
    outlined = (outline for outline in report.level.outlines if outline.reason is None)
    for number, outline in enumerate(outlined, start=1):
        if outline.corners_m:
            line = np.array(outline.corners_m)[:, :2]
            near = np.flatnonzero(((at >= line.min(axis=0)) & (at <= line.max(axis=0))).all(axis=1))
            found[near[_native.inside([line], at[near])]] = min(number, 255)
    return found.reshape(len(y_m), len(x_m))


def _packed(values: NDArray[Any], kind: type[np.generic]) -> dict[str, str]:
    """Return an array in Plotly's format."""
    plain = np.ascontiguousarray(values, dtype=kind)
    code = {np.float32: "f4", np.uint8: "u1"}[kind]  # type: ignore[index]
    shape = ", ".join(map(str, plain.shape))
    return {"bdata": b64encode(plain.tobytes()).decode(), "dtype": code, "shape": shape}


def _labels(
    report: Report,
    pile: NDArray[np.int64],
    heights_m: NDArray[np.float64],
    centers: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> list[dict[str, Any]]:
    """Return a label at the top of each pile."""
    shown = Shown.of(report)
    labels = []
    for item in report.piles[:254]:
        own = np.where(pile == item.id, heights_m, np.nan)
        if np.isnan(own).all():
            continue
        row, column = np.unravel_index(np.nanargmax(own), own.shape)
        place = {"x": float(centers[0][column]), "y": float(centers[1][row])}
        text = f"{item.id}: {shown.measured(item)} {shown.unit}"
        labels.append({**place, "z": float(own[row, column]), "text": text})
    return labels
