"""Bulk materials: density with its uncertainty, and angle of repose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Sources of the densities and angles.
SOURCE = "Deere OMN300820; CEMA tables; Wikipedia, Test weight; agriculture.com"

#: Largest relative variation of one material's density with how it is poured and measured.
SPREAD = 0.13


@dataclass(frozen=True)
class Material:
    """A bulk material.

    Attributes
    ----------
    density_range_kg_m3
        Range of the bulk density; every value in it is equally likely.
    repose_deg
        Range of the angle of repose; None if the sources give none.

    """

    density_range_kg_m3: tuple[float, float]
    repose_deg: tuple[float, float] | None = None

    @property
    def density_kg_m3(self) -> float:
        """The middle of the range."""
        return sum(self.density_range_kg_m3) / 2.0

    @property
    def density_u_kg_m3(self) -> float:
        """Standard uncertainty of a rectangular distribution (GUM 4.3.7)."""
        low, high = self.density_range_kg_m3
        return (high - low) / math.sqrt(12.0)


def _around(density_kg_m3: float, repose_deg: tuple[float, float] | None) -> Material:
    """Return a material for which the sources give a single density."""
    half = 0.5 * SPREAD * density_kg_m3
    return Material((density_kg_m3 - half, density_kg_m3 + half), repose_deg)


MATERIALS: Mapping[str, Material] = MappingProxyType(
    {
        "corn": _around(721.0, (23.0, 23.0)),
        "wheat": _around(774.0, (25.0, 27.0)),
        "soybean": _around(774.0, (25.0, 25.0)),
        "barley": _around(619.0, (28.0, 28.0)),
        "oats": _around(413.0, (28.0, 28.0)),
        "rye": _around(722.0, None),
        "sorghum": _around(645.0, None),
        "anthracite": _around(960.0, (35.0, 35.0)),
        "lignite": Material((640.0, 720.0), (38.0, 38.0)),
        "crushed-stone": _around(1600.0, (35.0, 36.0)),
    }
)
"""Materials by name."""
