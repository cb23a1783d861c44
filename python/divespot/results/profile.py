"""Cross-sections through a pile: its surface, its base, and unseen parts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.level import Level, Outline

#: A section extends beyond the outline by this share of its length.
BEYOND = 0.15

#: Number of positions along a section.
PLACES = 240


@dataclass(frozen=True, eq=False)
class Profile:
    """Heights along a line across a pile, in metres above the ground.

    `surface_m` is interpolated in gaps, where `is_seen` is False; both are NaN outside the map.
    """

    along_m: NDArray[np.float64]
    surface_m: NDArray[np.float64]
    base_m: NDArray[np.float64]
    is_seen: NDArray[np.bool_]


def profiles(
    level: Level, outline: Outline, whole_m: NDArray[np.float64], base_m: NDArray[np.float64]
) -> tuple[Profile, Profile]:
    """Return the section along a pile and the one across it, through the middle of its outline.

    `whole_m` are the heights with gaps filled, `base_m` the base without gaps.
    """
    corners = np.array(outline.corners_m)[:, :2]
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2.0
    axes = _axes(corners)
    made = [_profile(level, middle, axis, corners, whole_m, base_m) for axis in axes]
    return made[0], made[1]


def _axes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the directions in which an outline is longest and narrowest."""
    closed = np.vstack([corners, corners[:1]])
    # At even distances along the outline, since corners are denser where it bends.
    steps = np.hypot(*np.diff(closed, axis=0).T)
    at = np.linspace(0.0, steps.sum(), 256)
    ends = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.column_stack([np.interp(at, ends, closed[:, axis]) for axis in (0, 1)])
    _, vectors = np.linalg.eigh(np.cov(even.T))
    return np.asarray(vectors.T[::-1])


def _profile(  # noqa: PLR0913, PLR0917 - all that a section is made of
    level: Level,
    middle: NDArray[np.float64],
    axis: NDArray[np.float64],
    corners: NDArray[np.float64],
    whole_m: NDArray[np.float64],
    base_m: NDArray[np.float64],
) -> Profile:
    reach = (corners - middle) @ axis
    span = float(np.ptp(reach))
    along = np.linspace(reach.min() - BEYOND * span, reach.max() + BEYOND * span, PLACES)
    grid = level.height_map
    at = (middle + along[:, None] * axis - grid.origin_m) / grid.cell_m
    surface, base = (_between(values, at) - level.ground_m for values in (whole_m, base_m))
    rows, columns = grid.heights_m.shape
    column, row = np.floor(at).astype(int).T
    is_seen = ~np.isnan(grid.heights_m[row.clip(0, rows - 1), column.clip(0, columns - 1)])
    return Profile(along - along[0], surface, base, is_seen & ~np.isnan(surface))


def _between(values: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values interpolated between the middles of cells (bilinear), NaN outside.

    `at` are columns and rows from the corner of the first cell, shape ``(n, 2)``.
    """
    rows, columns = values.shape
    column, row = (at - 0.5).T
    inside = (column >= 0) & (column <= columns - 1) & (row >= 0) & (row <= rows - 1)
    j = np.floor(column).astype(int).clip(0, max(columns - 2, 0))
    i = np.floor(row).astype(int).clip(0, max(rows - 2, 0))
    u, v = column - j, row - i
    right, below = np.minimum(j + 1, columns - 1), np.minimum(i + 1, rows - 1)
    near = (1.0 - u) * values[i, j] + u * values[i, right]
    far = (1.0 - u) * values[below, j] + u * values[below, right]
    return np.where(inside, (1.0 - v) * near + v * far, math.nan)
