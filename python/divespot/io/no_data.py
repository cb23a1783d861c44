"""Heights that mean no data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.numbers import rounded

if TYPE_CHECKING:
    from divespot.io.scan import FloatArray

#: Usual no-data codes of raster writers, in any unit.
CODES = (-9999.0, -99999.0, -999999.0, -32767.0, -32768.0, 32767.0, 9999.0, 99999.0, -999.0)

#: Heights beyond this are the largest float, not a position.
LARGEST = 1e30

#: Fewest points with the same height for it to mean no data: outliers do not coincide.
FEWEST = 10

#: A no-data height is farther from all others than this many times their span.
SPANS = 10.0


def without_no_data(xyz: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Return points with NaN for no-data heights, and a warning about them.

    A no-data height is the lowest or the highest one, shared by many points to the last digit, and
    far from all others: farther than the scene is wide, or, for one of the usual codes, than ten
    times the span of the others.
    """
    told: list[str] = []
    if not _shared(xyz):
        return xyz, ()
    for outermost in (np.fmin, np.fmax):
        height = _code(xyz, outermost)
        if height is None:
            continue
        same = xyz[:, 2] == height
        xyz = np.where(same[:, None], np.nan, xyz)
        text = f"{height:g}" if abs(height) > LARGEST else rounded(height, 6)
        told.append(
            f"{same.sum()} points share the height {text}, far from all others: "
            "they were dropped as no data"
        )
    return xyz, tuple(told)


def _shared(xyz: FloatArray) -> bool:
    """Return whether many points share the lowest or the highest height."""
    _, _, lowest, highest = _native.outermost(xyz, 0)
    return max(lowest, highest) >= FEWEST


def _code(xyz: FloatArray, outermost: np.ufunc) -> float | None:
    """Return the lowest or the highest height if it means no data."""
    heights = np.ascontiguousarray(xyz[:, 2])  # several times as fast to search
    height = float(outermost.reduce(heights))
    same = heights == height
    if not np.isfinite(height) or np.count_nonzero(same) < FEWEST:
        return None
    others = heights[np.isfinite(heights) & ~same]
    if len(others) < FEWEST:
        return None
    gap, span = abs(height - float(outermost.reduce(others))), float(np.ptp(others))
    is_code = height in CODES or abs(height) > LARGEST
    return height if gap > SPANS * span and (is_code or gap > _width(xyz)) else None


def _width(xyz: FloatArray) -> float:
    return float(np.ptp(xyz[np.isfinite(xyz).all(axis=1), :2], axis=0).max())
