"""Outlines in another reference system than the scan's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.extras import is_installed
from divespot.io.systems import is_same_system, known_system, reprojected
from divespot.outline_checks import are_degrees, refuse_degrees

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

#: The system of GeoJSON that states none (RFC 7946): longitude and latitude of WGS 84.
WGS84 = "OGC:CRS84"


@dataclass(frozen=True, eq=False)
class Placing:
    """Conversion of corners to the scan's own system.

    Attributes
    ----------
    scan_at
        Shape ``(3,)``: a position in the scan, in its own frame and unit.
    source, target
        The outlines' system and the scan's, if they differ and both are known.
    by_default
        The scan's system, if the outlines state none: degrees are then WGS 84.
    warn
        Called with each warning, possibly more than once with the same.

    """

    scan_at: NDArray[np.float64]
    source: Any = None
    target: Any = None
    by_default: Any = None
    warn: Callable[[str], object] = str

    @classmethod
    def of(
        cls,
        stated: str | None,
        crs: str | None,
        scan_at: NDArray[np.float64],
        warn: Callable[[str], object],
    ) -> Placing:
        """Compare the system that a file of outlines states with the scan's."""
        if stated is None:
            return cls(scan_at, by_default=known_system(crs), warn=warn)
        if not crs or is_same_system(stated, crs):
            return cls(scan_at)
        source, target = known_system(stated), known_system(crs)
        if source is None or target is None:
            need = "" if is_installed("pyproj") else ": pip install divespot[crs]"
            warn(f"whether the outlines are in the scan's system cannot be told{need}")
            return cls(scan_at)
        warn(f"the outlines were reprojected from {source.name} to {target.name}")
        return cls(scan_at, source, target)

    def __call__(self, corners: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return corners, shape ``(n, 2)`` or ``(n, 3)``, in the scan's frame and unit.

        Raises
        ------
        DivespotError
            The corners are degrees, and the scan's system is not known.

        """
        source, target = self.source, self.target
        if self.by_default is not None and are_degrees(corners, self.scan_at):
            source, target = known_system(WGS84), self.by_default
            self.warn(f"the outlines were reprojected from WGS 84 to {target.name}")
        if source is None:
            refuse_degrees(corners, self.scan_at)
            return corners
        plan = reprojected(corners[:, :2], source, target)
        if not np.isfinite(plan).all():
            raise DivespotError(
                f"does not lie where {target.name} is defined: a place inside is needed"
            )
        return np.column_stack([plan, corners[:, 2:]])
