"""The volume of the alpha shape."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.volume.geometry import above_base, positive, simplices

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def alpha_shape(points_m: ArrayLike, alpha_m: float) -> float:
    """Return the volume of the alpha shape of a pile and its foot on the base.

    It consists of the Delaunay tetrahedra with a circumscribed sphere of radius `alpha_m` or less.
    Source: Edelsbrunner and Mücke, Three-dimensional alpha shapes (1994); the paper's second
    method of comparison. Known weakness: the result depends on alpha. Below half of the pile's
    height the inside is lost; far above it the hollows of the surface are filled up to the hull.

    Parameters
    ----------
    points_m
        Shape ``(n, 3)``: x, y and the height above the base.
    alpha_m
        Largest radius of an empty sphere.

    Raises
    ------
    DivespotError
        `points_m` have the wrong shape or are not finite, `alpha_m` is not above 0, or SciPy is
        not installed.

    Examples
    --------
    >>> import numpy as np
    >>> from divespot.volume import alpha_shape
    >>> x, y = (axis.ravel() for axis in np.meshgrid(np.arange(-20, 21), np.arange(-20, 21)))
    >>> z = 1 - np.hypot(x, y) / 20  # a cone 1 m high, 2 m wide: 1.047 m3
    >>> points = np.column_stack([x / 20, y / 20, z])[z >= 0]
    >>> round(alpha_shape(points, 1.0), 2)
    1.04

    """
    largest_m = positive("alpha_m", alpha_m)
    volumes, radii = tetrahedra(points_m)
    return float(volumes[radii <= largest_m].sum())


#: Points are moved at random by this share of their spacing.
SHAKEN = 0.001


def shaken(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points moved slightly off their raster, equally for equal numbers of points.

    Thousands of points on one plane and in one raster have no unique triangulation, and Qhull would
    take minutes.
    """
    if not len(points_m):
        return points_m
    spacing = np.sqrt(np.ptp(points_m[:, :2], axis=0).prod() / len(points_m))
    draws = np.random.default_rng(0).uniform(-SHAKEN, SHAKEN, points_m.shape)
    return np.asarray(points_m + spacing * draws)


def tetrahedra(points_m: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return volumes and circumscribed radii of the Delaunay tetrahedra, each shape ``(m,)``.

    Tetrahedra too flat to have a radius get volume 0 and an infinite radius.
    """
    points = shaken(above_base(points_m))
    corners = points[simplices(points)]
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
    across = np.cross(b, c)
    six_volumes = np.abs((a * across).sum(axis=1))

    def square(v: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray((v * v).sum(axis=1, keepdims=True))

    middle = square(a) * across + square(b) * np.cross(c, a) + square(c) * np.cross(a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        radii = np.sqrt(square(middle)[:, 0]) / (2.0 * six_volumes)
    return six_volumes / 6.0, np.where(np.isnan(radii), np.inf, radii)
