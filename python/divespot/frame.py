"""Conversion between the scan's own frame and unit and the level frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot.gaps import NO_GAPS
from divespot.io import UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.gaps import Gaps
    from divespot.pose import Pose


@dataclass(frozen=True, eq=False)
class Frame:
    """The position of the level frame in the scan.

    Attributes
    ----------
    pose
        Pose of the ground in the cloud.
    origin_m
        Shape ``(3,)``: the cloud's origin in the scan, in metres.
    unit
        The unit of the scan's numbers.
    scale
        Metres of the scan's x and y to a metre of the cloud's: the scale of its projection.
    gaps
        Empty bands that were closed up in the positions passed to `to_scan`.

    """

    pose: Pose
    origin_m: NDArray[np.float64]
    unit: str
    scale: float = 1.0
    gaps: Gaps = NO_GAPS

    @property
    def metres(self) -> float:
        """Metres in the scan's unit."""
        return UNITS[self.unit]

    def to_scan(self, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return positions of the level frame, shape ``(..., 3)``, in the scan's frame and unit."""
        restored = self.pose.restored(self.gaps.opened(positions_m)) * (self.scale, self.scale, 1.0)
        return np.asarray((restored + self.origin_m) / self.metres)

    def to_level(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return positions in the scan's frame and unit, shape ``(n, 3)``, in the level frame."""
        near_m = positions * self.metres - self.origin_m
        return self.pose.level(near_m / (self.scale, self.scale, 1.0), 1)

    def plan_to_level(self, plan: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x and y of the scan, shape ``(n, 2)``, as x and y of the level frame.

        Each position is projected along the scan's z axis onto the ground's plane.
        """
        z = self.origin_m[2] / self.metres
        at = self.to_level(np.column_stack([plan, np.full(len(plan), z)]))
        along = self.pose.rotation[:, 2]
        return np.asarray(at[:, :2] - at[:, 2:] / along[2] * along[:2])
