"""Units in which volumes are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot.errors import DivespotError
from divespot.mass import density_of
from divespot.numbers import volume_unit, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.report import Pile, Report, Total
    from divespot.settings import Settings

#: For each unit its sign and how many make a cubic metre: NIST SP 811, B.8; the bushel is the US
#: (Winchester) bushel of 2150.42 cubic inches.
VOLUMES = {
    "m3": ("m³", 1.0),
    "yd3": ("yd³", 1.0 / 0.9144**3),
    "L": ("L", 1000.0),
    "bu": ("bu", 1.0 / (2150.42 * 0.0254**3)),
}

#: Units that can be asked for; t is the mass in tonnes.
NAMES = (*VOLUMES, "t")

KG_PER_T = 1000.0


@dataclass(frozen=True)
class Shown:
    """How volumes are shown: as ``what`` in a unit, of which `per_m3` make a cubic metre.

    If masses are shown instead, `per_m3` is 0, and each pile's factor is derived from its material
    and the settings, which are None otherwise.
    """

    what: str
    unit: str
    per_m3: float
    settings: Settings | None = None

    @classmethod
    def of(cls, report: Report, name: str | None = None) -> Shown:
        """Return the unit of that name, or the one that suits the report.

        Raises
        ------
        DivespotError
            Tonnes were asked for, and the density of a pile is not known.

        """
        items = (*report.piles, *report.other_objects)
        if name is None:
            return cls("volume", *volume_unit(_largest_m3(items)))
        if name in VOLUMES:
            return cls("volume", *VOLUMES[name])
        materials = [item.material for item in items] or [None]
        if any(density_of(material, report.settings) is None for material in materials):
            raise DivespotError(
                "the unit t was given without a density: --material or --density is needed"
            )
        return cls("mass", "t", 0.0, report.settings)

    @property
    def as_mass(self) -> bool:
        """Whether masses are shown instead of volumes."""
        return self.settings is not None

    @property
    def header(self) -> str:
        """The name of the column."""
        return f"{self.what} {self.unit}"

    def per_m3_of(self, pile: Pile) -> float:
        """Return how many of the unit make a cubic metre of a pile."""
        if self.settings is None:
            return self.per_m3
        kg_m3, _ = density_of(pile.material, self.settings) or (0.0, 0.0)
        return kg_m3 / KG_PER_T

    @staticmethod
    def number(value: float, u95: float) -> str:
        """Return a number rounded to the digits that its uncertainty justifies."""
        return with_uncertainty(value, u95).partition(" ")[0]

    def rounded(self, item: Pile | Total) -> str:
        """Return a volume or mass, rounded to the digits that its uncertainty justifies."""
        return self.measured(item).partition(" ")[0]

    def measured(self, item: Pile | Total) -> str:
        """Return a volume or mass, with its uncertainty."""
        if not self.as_mass:
            return with_uncertainty(self.per_m3 * item.volume_m3, self.per_m3 * item.u95_m3)
        mass, u95 = item.mass_kg or 0.0, item.u95_mass_kg or 0.0
        return with_uncertainty(mass / KG_PER_T, u95 / KG_PER_T)


def _largest_m3(items: Sequence[Pile]) -> float:
    return max((abs(item.volume_m3) for item in items), default=1.0)
