"""The coordinates of a plan."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from divespot.io import UNITS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.intake import Source
    from divespot.level import Level

#: If up is farther than this from the scan's z axis, its x and y are not plan coordinates.
PLAN_DEG = 30.0


class Placed(Protocol):
    """A report or a comparison: heights in a level frame, and the scan they belong to."""

    @property
    def level(self) -> Level:
        """The levelled scene."""

    @property
    def source(self) -> Source:
        """Where the points came from."""


@dataclass(frozen=True, eq=False)
class PlanFrame:
    """Conversion from cells and positions of the level frame to the plan.

    Attributes
    ----------
    matrix
        Shape ``(2, 3)``: x and y of the plan are ``matrix @ (column, row, 1)``, counted in cells
        from the corner of the first cell.
    is_scan
        Whether x and y are the scan's own; otherwise they are those of the level frame.
    unit, metres
        The plan's unit, and its length in metres.

    """

    report: Placed
    matrix: NDArray[np.float64]
    is_scan: bool
    unit: str
    metres: float

    @classmethod
    def of(cls, report: Placed) -> PlanFrame:
        """Return the scan's own x and y if they are plan coordinates of its ground."""
        level = report.level
        is_scan = bool(level.frame.pose.rotation[2, 2] > math.cos(math.radians(PLAN_DEG)))
        unit = report.source.unit if is_scan else "m"
        bare = cls(report, np.zeros((2, 3)), is_scan, unit, UNITS[unit])
        grid = level.height_map
        corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]) * grid.cell_m + grid.origin_m
        at = bare.places(np.column_stack([corners, np.full(3, level.ground_m)]))
        matrix = np.column_stack([at[1] - at[0], at[2] - at[0], at[0]])
        return cls(report, matrix, is_scan, unit, bare.metres)

    def places(self, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return x and y of positions in the level frame, shape ``(n, 3)``."""
        level = self.report.level
        if self.is_scan:
            return np.asarray(level.frame.to_scan(positions_m)[:, :2])
        return np.asarray(positions_m[:, :2] - level.height_map.origin_m)

    def corners(self) -> NDArray[np.float64]:
        """Return the four corners of the map, shape ``(4, 2)``."""
        rows, columns = self.report.level.height_map.heights_m.shape
        at = np.array([(0, 0, 1), (columns, 0, 1), (columns, rows, 1), (0, rows, 1)], dtype=float)
        return np.asarray(at @ self.matrix.T)

    @property
    def up_arrow(self) -> str:
        """Label of the direction of the plan's y axis: north in a reference system."""
        return "N" if self.is_scan and self.report.source.crs else "y"
