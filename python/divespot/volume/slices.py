"""The volume of layers of equal thickness."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from divespot._arguments import number, word
from divespot.errors import DivespotError
from divespot.volume.geometry import checked, hull_measure, positive, spatial
from divespot.volume.tin import areas

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Contour = Callable[[NDArray[np.float64]], float]


CONTOURS = ("convex", "concave")


def slices(
    points_m: ArrayLike,
    slice_m: float,
    *,
    contour: Literal["convex", "concave"] = "convex",
    reach_m: float = np.inf,
) -> float:
    """Add up the layers of a pile: area of the contour of each one's points, times thickness.

    Source: the slice-based methods of the paper's introduction and comparison. Known weakness:
    the result depends on the thickness. A thick layer counts with its lowest and largest contour;
    a thin one has too few points for a contour; a convex contour fills the space between peaks.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.
    slice_m
        Thickness of a layer; the first one begins at the base.
    contour
        The convex hull in plan, or a concave contour: the area that a disc rolling in from outside
        cannot reach without covering a point (the alpha shape of the contour, filled).
    reach_m
        Radius of that disc; not used for a convex contour.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, a length is not above 0, or SciPy is
        not installed.

    Examples
    --------
    >>> import numpy as np
    >>> from divespot.volume import slices
    >>> x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)))
    >>> z = 1 - np.hypot(x, y) / 20  # a cone 1 m high, 2 m wide: 1.047 m3
    >>> points = np.column_stack([x / 20, y / 20, z])[z >= 0]
    >>> round(slices(points, 0.05), 2)
    1.07

    """
    points = checked(points_m)
    standing = points[points[:, 2] > 0.0]
    thickness_m = positive("slice_m", slice_m, float(standing[:, 2].max(initial=0.0)))
    layer = np.floor(standing[:, 2] / thickness_m)
    order = np.argsort(layer, kind="stable")
    starts = np.flatnonzero(np.diff(layer[order])) + 1
    if word("contour", contour) not in CONTOURS:
        raise DivespotError(f"contour is {contour!r}: one of {', '.join(CONTOURS)} is needed")
    rolled = partial(_concave, reach_m=number("reach_m", reach_m))
    area: Contour = hull_measure if contour == "convex" else rolled
    return thickness_m * sum(area(standing[part, :2]) for part in np.split(order, starts))


def _concave(places_m: NDArray[np.float64], reach_m: float) -> float:
    """Return the area that a disc of radius `reach_m` rolling in from outside does not reach."""
    module = spatial()
    if len(places_m) < 3:
        return 0.0
    try:
        mesh = module.Delaunay(places_m)
    except module.QhullError:
        return 0.0
    corners = places_m[mesh.simplices]
    # Side i and neighbour i are opposite corner i.
    sides = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
    wide = np.linalg.norm(sides, axis=2) > 2.0 * reach_m
    return float(areas(corners)[~_reached(mesh.neighbors, wide)].sum())


def _reached(neighbors: NDArray[np.intp], wide: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which triangles are connected to the outside through wide sides."""
    reached = np.asarray((wide & (neighbors < 0)).any(axis=1))
    front = np.flatnonzero(reached)
    while len(front):
        near = np.unique(neighbors[front][wide[front]])
        near = near[near >= 0]
        front = near[~reached[near]]
        reached[front] = True
    return reached
