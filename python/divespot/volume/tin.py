"""The volume of the prisms under a triangulated surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot._arguments import as_floats
from divespot.errors import DivespotError
from divespot.volume.body import inside
from divespot.volume.geometry import FARTHEST_M, checked, simplices

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def tin(points_m: ArrayLike, outline_m: ArrayLike | None = None) -> float:
    """Return the volume of the prisms between the triangles of a surface and the base.

    The triangles are Delaunay's in plan (2.5D), what lies below the base counts as missing.
    Source: the triangulated irregular network of survey practice, after Peucker et al. (1978).
    Known weakness: it ends at the outermost points, half a cell short all round, and long
    triangles span what was not seen, and bays of the outline where none is given.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.
    outline_m
        Shape ``(k, 2)``: triangles whose middle lies outside do not count.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, or SciPy is not installed.

    """
    points = checked(points_m)
    corners = points[simplices(points[:, :2])]
    middles = corners.mean(axis=1)
    if outline_m is not None:
        within = inside(middles[:, :2], _closed(outline_m))
        corners, middles = corners[within], middles[within]
    return float((areas(corners[:, :, :2]) * middles[:, 2]).sum())


def _closed(outline_m: ArrayLike) -> NDArray[np.float64]:
    """Return the corners of an outline as numbers."""
    corners = as_floats("outline_m", outline_m).astype(np.float64, copy=False)
    if corners.ndim != 2 or corners.shape[1] != 2 or not (np.abs(corners) <= FARTHEST_M).all():
        raise DivespotError(
            f"outline_m has shape {corners.shape}: numbers up to {FARTHEST_M:g} of shape (k, 2) "
            "are needed"
        )
    return corners


def areas(corners_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the areas of triangles, whose corners have shape ``(m, 3, 2)``."""
    (ax, ay), (bx, by) = (np.moveaxis(corners_m[:, i] - corners_m[:, 0], 1, 0) for i in (1, 2))
    return np.asarray(0.5 * np.abs(ax * by - ay * bx))
