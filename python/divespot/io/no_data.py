"""Heights that stand for no data."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.numbers import rounded

if TYPE_CHECKING:
    from divespot.io.scan import FloatArray

#: What writers of rasters put where nothing is known, whatever their unit.
CODES = (-9999.0, -99999.0, -999999.0, -32767.0, -32768.0, 32767.0, 9999.0, 99999.0, -999.0)

#: Heights beyond this are the largest number of a float, not a place.
LARGEST = 1e30

#: Fewest points that share a height for it to stand for no data: strays do not coincide.
FEWEST = 10

#: Such a height lies farther from all others than so many times their span.
SPANS = 10.0


def without_no_data(xyz: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
    """Return points with NaN for a height that means no data, and what was replaced.

    It is the lowest or the highest of all heights, many points share it to the last digit, and it
    lies far from all others: farther than the scene is wide, or, for a number that is a usual
    code, than ten times the span of the others.
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
    """Return whether many points share the lowest or the highest of all heights."""
    _, _, lowest, highest = _native.outermost(xyz, 0)
    return max(lowest, highest) >= FEWEST


def _code(xyz: FloatArray, outermost: np.ufunc) -> float | None:
    """Return the lowest or highest height where it means no data."""
    heights = np.ascontiguousarray(xyz[:, 2])  # several times as fast to look at
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
