"""Planes and the rotation that lays them level (paper, Algorithm 2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot._arguments import as_floats, number, seed_number, thread_number, whole
from divespot.dot import dot
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Plane:
    """A plane ``normal @ p == offset_m``.

    Attributes
    ----------
    normal
        Unit normal, on the side of the given axis; without an axis, z >= 0.
    offset_m
        Distance from the coordinates' origin along the normal.
    inliers
        Number of points within the threshold.
    rms_m
        Root mean square distance of those points from the plane.

    """

    normal: tuple[float, float, float]
    offset_m: float
    inliers: int
    rms_m: float

    def heights_m(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return signed distances, shape ``(n,)``, positive on the normal's side."""
        return np.asarray(dot(points, self.normal) - self.offset_m)


def fit_plane(  # noqa: PLR0913 - one keyword a setting of RANSAC
    points: ArrayLike,
    threshold_m: float,
    *,
    hypotheses: int = 1000,
    axis: Sequence[float] | None = None,
    max_tilt_deg: float = 90.0,
    seed: int = 0,
    threads: int = 0,
) -> Plane:
    """Fit the plane that most points support: RANSAC, then least squares (Algorithm 2, lines 2, 3).

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres.
    threshold_m
        A point this near to the plane supports it.
    hypotheses
        Largest number of planes through three random points to try; fewer once a better plane is
        unlikely. They are scored by MSAC on 4,096 random points; the best is refitted to all
        points within the threshold until it converges.
    axis, max_tilt_deg
        If an axis is given, only planes are considered whose normal is within this angle of it,
        and the normal points to its side.
    seed
        Seed of the random draws; the order of the points does not matter.
    threads
        Number of threads; 0: every core available to the process.

    Raises
    ------
    DivespotError
        Fewer than three points, all on one line, no admissible plane, or a setting out of range.

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> x, y = np.random.default_rng(0).uniform(0, 1, (2, 1000))
    >>> plane = divespot.fit_plane(np.column_stack([x, y, 0.5 + 0 * x]), threshold_m=0.01)
    >>> plane.inliers, round(plane.offset_m, 9), np.round(plane.normal, 9).tolist()
    (1000, 0.5, [0.0, 0.0, 1.0])

    """
    return Plane(
        *_native.fit_plane(
            as_floats("points", points),
            number("threshold_m", threshold_m),
            whole("hypotheses", hypotheses),
            cone(axis, max_tilt_deg),
            seed_number(seed),
            thread_number(threads),
        )
    )


def cone(
    axis: Sequence[float] | None, max_tilt_deg: float
) -> tuple[tuple[float, float, float], float] | None:
    """Return the admissible normals as the native kernels take them."""
    if axis is None:
        return None
    try:
        x, y, z = (float(v) for v in axis)
    except (TypeError, ValueError):
        raise DivespotError(f"axis is {axis!r}: three numbers are needed") from None
    if not 0.0 < max(abs(x), abs(y), abs(z)) < math.inf:
        raise DivespotError(f"axis is {axis!r}: finite numbers that are not all 0 are needed")
    return (x, y, z), math.radians(number("max_tilt_deg", max_tilt_deg))


def rotation_to_z(normal: Sequence[float]) -> NDArray[np.float64]:
    """Return the rotation that turns `normal` onto +z by the smallest angle (Rodrigues' formula).

    Parameters
    ----------
    normal
        Three numbers, of any length but 0.

    Returns
    -------
    rotation
        Shape ``(3, 3)``: ``rotation @ normal`` lies along +z; for points as rows,
        ``points @ rotation.T``. The paper's `T` is its transpose. The paper names z as the axis
        of rotation, but the axis is the unit vector along ``normal x z``. A normal along -z has
        no unique smallest rotation and is turned about x.

    Raises
    ------
    DivespotError
        `normal` is not three finite numbers that are not all 0.

    Examples
    --------
    >>> import numpy as np
    >>> import divespot
    >>> (divespot.rotation_to_z([3, 0, 0]) @ [1, 0, 0]).round(9).tolist()
    [0.0, 0.0, 1.0]

    """
    axis = cone(normal, 0.0)
    return _native.rotation_to_z(axis[0] if axis else (0.0, 0.0, 0.0))
