"""The volume of the prisms under a triangulated surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.volume.body import inside
from divespot.volume.geometry import checked, numbers, simplices

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def tin(points_m: ArrayLike, outline_m: ArrayLike | None = None) -> float:
    """Return the volume of the prisms between the triangles of a surface and the base.

    The triangles are Delaunay's in plan (2.5D); volume below the base counts as missing.
    Source: the triangulated irregular network of survey practice, after Peucker et al. (1978).
    Known weakness: it ends at the outermost points, half a cell short all round, and long triangles
    cover unseen areas, and bays of the outline if none is given.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.
    outline_m
        Shape ``(k, 2)``: triangles with their middle outside do not count.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, or SciPy is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> from divespot.volume import tin
    >>> x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)))
    >>> z = 1 - np.hypot(x, y) / 20  # a cone 1 m high, 2 m wide: 1.047 m3
    >>> points = np.column_stack([x / 20, y / 20, z])[z >= 0]
    >>> round(tin(points), 2)
    1.05

    """
    points = checked(points_m)
    corners = points[simplices(points[:, :2])]
    middles = corners.mean(axis=1)
    if outline_m is not None:
        within = inside(middles[:, :2], numbers("outline_m", outline_m, ("k", 2)))
        corners, middles = corners[within], middles[within]
    return float((areas(corners[:, :, :2]) * middles[:, 2]).sum())


def areas(corners_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the areas of triangles, whose corners have shape ``(m, 3, 2)``."""
    (ax, ay), (bx, by) = (np.moveaxis(corners_m[:, i] - corners_m[:, 0], 1, 0) for i in (1, 2))
    return np.asarray(0.5 * np.abs(ax * by - ay * bx))
