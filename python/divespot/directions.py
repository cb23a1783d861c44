"""Directions in space, and how users type them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from divespot.dot import dot
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

Position = tuple[float, float, float]

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
AXES = {"x": X, "y": Y, "z": Z}


#: Accepted values of `up`.
UPWARD = "auto, x, y, z, -x, -y, -z, or three numbers a,b,c that are not all 0"


def parse_up(up: str | Position) -> Position | None:
    """Return the direction that `up` names; None for auto.

    Raises
    ------
    DivespotError
        It is none of auto, x, y, z, -x, -y, -z and three numbers.

    """
    if not isinstance(up, str):
        return up
    if up == "auto":
        return None
    if up.lstrip("+-") in AXES and len(up) <= 2:
        sign = -1.0 if up.startswith("-") else 1.0
        x, y, z = AXES[up.lstrip("+-")]
        return sign * x, sign * y, sign * z
    try:
        x, y, z = (float(part) for part in up.split(","))
    except ValueError:
        x = y = z = 0.0
    if not 0.0 < max(abs(x), abs(y), abs(z)) < math.inf:
        raise DivespotError(f"up is {up!r}: {UPWARD} are needed")
    return x, y, z


def upward(normal: ArrayLike, up: str | Position) -> NDArray[np.float64]:
    """Return the unit vector that is up; for auto, along the axis nearest to the normal."""
    asked = parse_up(up)
    if asked is not None:
        return np.asarray(np.array(asked) / np.sqrt(dot(asked, asked)))
    along = np.asarray(normal)
    nearest = int(np.abs(along).argmax())
    return np.asarray(np.copysign(1.0, along[nearest]) * np.array([*AXES.values()])[nearest])


def angle_deg(a: Position, b: Position) -> float:
    """Return the angle between a unit vector and another one of any length."""
    cosine = dot(a, b) / np.sqrt(dot(b, b))
    return math.degrees(math.acos(min(1.0, max(-1.0, float(cosine)))))
