"""The volume of layers of equal thickness."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from divespot.volume.geometry import checked, hull_measure, positive, spatial
from divespot.volume.tin import areas

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    Contour = Callable[[NDArray[np.float64]], float]


def slices(
    points_m: ArrayLike,
    slice_m: float,
    *,
    contour: Literal["convex", "concave"] = "convex",
    reach_m: float = np.inf,
) -> float:
    """Add up the layers of a pile: area of the contour of each one's points, times thickness.

    Source: the slice-based methods of the paper's introduction and comparison. Known weakness:
    the answer hangs on the thickness. A thick layer counts with its lowest and largest contour,
    a thin one holds too few points to draw it; a convex contour fills what lies between peaks.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.
    slice_m
        Thickness of a layer; the first one begins at the base.
    contour
        The convex hull in plan, or a concave one: the outer edge of the Delaunay triangles whose
        circumscribed circle has a radius of at most `reach_m`, with all that it encloses.
    reach_m
        How far the points of a concave contour may lie apart; not used for a convex one.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, a length is not above 0, or SciPy is
        not installed.

    """
    points = checked(points_m)
    standing = points[points[:, 2] > 0.0]
    layer = np.floor(standing[:, 2] / positive("slice_m", slice_m))
    order = np.argsort(layer, kind="stable")
    starts = np.flatnonzero(np.diff(layer[order])) + 1
    area: Contour = hull_measure if contour == "convex" else partial(_concave, reach_m=reach_m)
    return slice_m * sum(area(standing[part, :2]) for part in np.split(order, starts))


def _concave(places_m: NDArray[np.float64], reach_m: float) -> float:
    """Return the area inside the outer edge of the small triangles."""
    module = spatial()
    if len(places_m) < 3:
        return 0.0
    try:
        mesh = module.Delaunay(places_m)
    except module.QhullError:
        return 0.0
    corners = places_m[mesh.simplices]
    area = areas(corners)
    large = _circumradii(corners, area) > reach_m
    return float(area[~_open(mesh.neighbors, large)].sum())


def _circumradii(
    corners_m: NDArray[np.float64], area_m2: NDArray[np.float64]
) -> NDArray[np.float64]:
    sides = np.linalg.norm(corners_m - np.roll(corners_m, 1, axis=1), axis=2)
    with np.errstate(divide="ignore"):
        return np.asarray(sides.prod(axis=1) / (4.0 * area_m2))


def _open(neighbors: NDArray[np.intp], large: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Tell which large triangles are joined to the outside through large ones."""
    reached = large & (neighbors < 0).any(axis=1)
    front = np.flatnonzero(reached)
    while len(front):
        near = np.unique(neighbors[front])
        near = near[near >= 0]
        front = near[large[near] & ~reached[near]]
        reached[front] = True
    return reached
