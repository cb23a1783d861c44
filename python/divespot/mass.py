"""Mass from volume and bulk density."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any, Protocol

from divespot.materials import MATERIALS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.settings import Settings


class Weighed(Protocol):
    """The attributes of a pile that its mass depends on."""

    @property
    def material(self) -> str | None:
        """Its material."""

    @property
    def volume_m3(self) -> float:
        """Its volume."""

    @property
    def budget(self) -> Any:  # noqa: ANN401 - the report's, which imports this module
        """Its uncertainty budget."""


def mass_kg(
    volume_m3: float, u_m3: float, density: tuple[float, float] | None
) -> tuple[float | None, float | None]:
    """Return the mass and its standard uncertainty; None without a density.

    Relative uncertainties of volume and density add in squares (GUM 5.1.6).
    """
    if density is None:
        return None, None
    kg_m3, u_kg_m3 = density
    return kg_m3 * volume_m3, math.hypot(kg_m3 * u_m3, volume_m3 * u_kg_m3)


def density_of(material: str | None, settings: Settings) -> tuple[float, float] | None:
    """Return a density and its standard uncertainty: as given, or that of the material.

    The material is that of the outline, or else that of the settings, which hold its density
    already.
    """
    asked = MATERIALS.get(settings.material or "")
    given = settings.density_kg_m3
    is_given = given is not None and (asked is None or given != asked.density_kg_m3)
    if material is not None and not is_given:
        own = MATERIALS.get(material)
        return None if own is None else (own.density_kg_m3, own.density_u_kg_m3)
    return None if given is None else (given, settings.density_u_kg_m3 or 0.0)


def total_mass_kg(
    piles: Sequence[Weighed], common: Sequence[str], settings: Settings
) -> tuple[float | None, float | None]:
    """Return the mass of all piles, and its standard uncertainty; None if a pile has none.

    Terms common to all piles add linearly, and so do the density errors of piles of the same
    material.
    """
    densities = [density_of(pile.material, settings) for pile in piles]
    known = [density for density in densities if density is not None]
    if len(known) < len(piles) or (not piles and density_of(None, settings) is None):
        return None, None
    weighed = [(pile, kg_m3) for pile, (kg_m3, _) in zip(piles, known, strict=True)]
    shared = [sum(kg_m3 * getattr(pile.budget, term) for pile, kg_m3 in weighed) for term in common]
    none = dict.fromkeys(common, 0.0)
    own = [
        kg_m3 * dataclasses.replace(pile.budget, **none).combined_m3() for pile, kg_m3 in weighed
    ]
    volumes = dict.fromkeys(known, 0.0)
    for pile, density in zip(piles, known, strict=True):
        volumes[density] += pile.volume_m3
    by_density = [volume * u_kg_m3 for (_, u_kg_m3), volume in volumes.items()]
    mass = sum(kg_m3 * pile.volume_m3 for pile, kg_m3 in weighed)
    return float(mass), math.hypot(*shared, *own, *by_density)
