"""Scans in one file, each from its own position: their points in one frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.io.scan import FloatArray

#: Largest deviation from a rotation matrix, for matrices written with few digits.
MOST_OFF = 1e-3


@dataclass(frozen=True, eq=False)
class Setup:
    """Points in a scanner's own frame, and ``p -> turn @ p + place`` to the file's.

    Rows that are not finite or all zero are pixels without a point.
    """

    xyz: FloatArray
    turn: FloatArray
    place: FloatArray

    @property
    def is_moved(self) -> bool:
        """Whether the file states the scanner's position; if unknown, writers state no motion."""
        return bool((self.turn != np.eye(3)).any() or self.place.any())

    def seen(self) -> FloatArray:
        """Return seen points in the file's frame, and the other rows unchanged.

        Raises
        ------
        DivespotError
            The transformation is not a rigid motion.

        """
        off = np.abs(self.turn @ self.turn.T - np.eye(3)).max()
        if not (off <= MOST_OFF and np.linalg.det(self.turn) > 0 and np.isfinite(self.place).all()):
            raise DivespotError(
                "the transformation of a scan in it is no rigid motion: a rotation is needed"
            )
        if not self.is_moved:
            return self.xyz
        with np.errstate(over="ignore", invalid="ignore"):
            moved: FloatArray = self.xyz @ self.turn.T + self.place
        moved[~self.xyz.any(axis=1)] = 0.0
        return moved


def merged(
    setups: Sequence[Setup],
) -> tuple[FloatArray, tuple[float, float, float] | None]:
    """Return all points in the file's frame, and the position of the setup with the most points.

    Raises
    ------
    DivespotError
        A transformation is not a rigid motion.

    """
    if not setups:
        return np.empty((0, 3)), None
    most = max(setups, key=lambda setup: len(setup.xyz))
    x, y, z = most.place.tolist()
    parts = [setup.seen() for setup in setups]
    xyz = parts[0] if len(parts) == 1 else np.concatenate(parts)
    return xyz, (x, y, z) if most.is_moved else None
