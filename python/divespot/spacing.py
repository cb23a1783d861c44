"""Point spacing, roughness and normals of a cloud, from which all lengths are derived."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot import _native
from divespot._arguments import as_floats, seed_number, thread_number

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class Survey:
    """Point spacing, roughness and surface normals of a cloud.

    Attributes
    ----------
    spacing_m
        Typical distance between neighbouring points: the step of a square grid, about
        1.1 / sqrt(points per square metre) on a random surface, twice the step of a line.
    regular
        Whether the points are a regular raster, with the same spacing nearly everywhere.
    roughness_m
        Typical distance of a point from the plane through its sixteen nearest neighbours.
    at_m
        Shape ``(k, 3)``: some of the points, at most 2,000.
    normals
        Shape ``(k, 3)``: unit normals of the surface there, of arbitrary sign.
    sparse_m
        Point spacing of the sparse part: three quarters of the surface are at least as dense.
    positions
        Number of distinct positions; that of the points if no sampled point has a duplicate.

    """

    spacing_m: float
    regular: bool
    roughness_m: float
    at_m: NDArray[np.float64]
    normals: NDArray[np.float64]
    sparse_m: float
    positions: int


def survey(points: ArrayLike, *, seed: int = 0, threads: int = 0) -> Survey:
    """Sample the neighbourhoods of about 2,000 of the points.

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres. Duplicates count as one position.
    seed
        Seed of the sample of points; their order has no influence.
    threads
        Number of threads; 0: every core available to the process.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, or fewer than five distinct positions.

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> x, y = np.meshgrid(np.arange(40) * 0.02, np.arange(40) * 0.02)
    >>> floor = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    >>> found = divespot.survey(floor)
    >>> round(found.spacing_m, 9), found.regular, round(found.roughness_m, 9)
    (0.02, True, 0.0)

    """
    return Survey(
        *_native.survey(
            as_floats("points", points), seed_number(seed), thread_number(threads), own=False
        )
    )


def point_spacing(points: ArrayLike, *, seed: int = 0) -> float:
    """Return the typical distance between neighbouring points, in metres (see `Survey`).

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> x, y = np.meshgrid(np.arange(40) * 0.02, np.arange(40) * 0.02)
    >>> floor = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    >>> round(divespot.point_spacing(floor), 9)
    0.02

    """
    return survey(points, seed=seed).spacing_m
