"""Mass from volume and bulk density."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from divespot.settings import Settings


def mass_kg(volume_m3: float, u_m3: float, settings: Settings) -> tuple[float | None, float | None]:
    """Return the mass and its standard uncertainty; None without a density.

    Relative uncertainties of volume and density add in squares (GUM 5.1.6). All piles share the
    error of the density, so their total is weighed as one volume.
    """
    density = settings.density_kg_m3
    if density is None:
        return None, None
    u_density = settings.density_u_kg_m3 or 0.0
    return density * volume_m3, math.hypot(density * u_m3, volume_m3 * u_density)
