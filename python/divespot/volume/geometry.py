"""SciPy's hulls and triangulations, also for points on a plane or a line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import as_floats, number, shown
from divespot.errors import DivespotError
from divespot.extras import extra

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


#: Largest coordinate in metres, at which a float64 still resolves micrometres.
FARTHEST_M = 1e9

#: Largest ratio of an extent to a length that divides it.
MOST = 2**32


def spatial() -> Any:  # noqa: ANN401 - SciPy ships no types
    """Return SciPy's module of hulls and triangulations.

    Raises
    ------
    DivespotError
        SciPy is not installed.

    """
    return extra("scipy.spatial", "methods", "this volume method needs SciPy")


def simplices(points: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the Delaunay triangles or tetrahedra of points, shape ``(m, dimensions + 1)``.

    There are none if the points span no area or volume.
    """
    found = _unless_flat("Delaunay", points)
    none = np.empty((0, points.shape[1] + 1), dtype=np.intp)
    return none if found is None else np.asarray(found.simplices)


def hull_measure(points: NDArray[np.float64]) -> float:
    """Return the volume of the convex hull of points, or its area in two dimensions."""
    found = _unless_flat("ConvexHull", points)
    return 0.0 if found is None else float(found.volume)


def _unless_flat(name: str, points: NDArray[np.float64]) -> Any:  # noqa: ANN401 - as above
    module = spatial()
    if len(points) <= points.shape[1]:
        return None
    try:
        return getattr(module, name)(points)
    except module.QhullError:
        return None


def above_base(points_m: ArrayLike) -> NDArray[np.float64]:
    """Return points above the base, with their projections on it.

    Without the projections, only the surface would be enclosed, as a scan sees no pile from below.
    """
    points = checked(points_m)
    standing = points[points[:, 2] > 0.0]
    return np.concatenate([standing, standing * (1.0, 1.0, 0.0)])


def checked(points_m: ArrayLike) -> NDArray[np.float64]:
    """Return points, shape ``(n, 3)``, as numbers.

    Raises
    ------
    DivespotError
        The points have another shape or type, or are not finite.

    """
    return numbers("points_m", points_m, ("n", 3))


def numbers(name: str, values: ArrayLike, shape: tuple[str, int]) -> NDArray[np.float64]:
    """Return an array of numbers in rows; `shape` is its shape in an error message.

    Raises
    ------
    DivespotError
        The values have another shape or type, or are not finite.

    """
    found = as_floats(name, values).astype(np.float64, copy=False)
    rows, columns = shape
    if found.ndim != 2 or found.shape[1] != columns or not (np.abs(found) <= FARTHEST_M).all():
        raise DivespotError(
            f"{name} has shape {found.shape}: numbers up to {FARTHEST_M:g} of shape "
            f"({rows}, {columns}) are needed"
        )
    return found


def positive(name: str, value: float, extent_m: float = 0.0) -> float:
    """Return a length that must be above 0, and no less than 2**-32 of an extent."""
    length = number(name, value)
    if not 0.0 < length < np.inf:
        raise DivespotError(f"{name} is {shown(value)}: a finite number above 0 is needed")
    if extent_m > MOST * length:
        raise DivespotError(f"{name} is {length}: a larger part of {extent_m:.3g} m is needed")
    return length
