"""The volume of the convex hull."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.volume.geometry import above_base, hull_measure

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def hull(points_m: ArrayLike) -> float:
    """Return the volume of the 3D convex hull of a pile and its foot on the base.

    Source: the convex hull methods of the paper's introduction; Barber et al., Quickhull (1996),
    by SciPy. Known weakness: hollows between peaks and along a curved ridge are filled, and one
    outlier makes the hull larger, so that it is an upper bound.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, or SciPy is not installed.

    Examples
    --------
    >>> import numpy as np
    >>> from divespot.volume import hull
    >>> x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)))
    >>> z = 1 - np.hypot(x, y) / 20  # a cone 1 m high, 2 m wide: 1.047 m3
    >>> points = np.column_stack([x / 20, y / 20, z])[z >= 0]
    >>> round(hull(points), 2)
    1.05

    """
    return hull_measure(above_base(points_m))
