"""Units of length, and the names and numbers by which files state them."""

from __future__ import annotations

import math
import re
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Mapping

UNITS: Mapping[str, float] = MappingProxyType(
    {
        "m": 1.0,
        "dm": 0.1,
        "cm": 0.01,
        "mm": 0.001,
        "km": 1000.0,
        "in": 0.0254,
        "ft": 0.3048,
        "us-ft": 1200.0 / 3937.0,
        "yd": 0.9144,
    }
)
"""Metres per unit."""

DEGREES = "degrees"
"""Name of the unit of a geographic reference system, which is not a length."""

STRETCHED = "metres of a Mercator or equidistant cylindrical map"
"""Name of the unit of such a reference system, which is not a metre off the equator."""

_SPELLINGS = {
    "m": ("m", "meter", "meters", "metre", "metres"),
    "ft": ("ft", "foot", "feet", "footinternational", "internationalfoot"),
    "us-ft": ("usft", "ftus", "footus", "ussurveyfoot", "ussurveyfeet", "usfeet"),
    "mm": ("mm", "millimeter", "millimeters", "millimetre", "millimetres"),
    "cm": ("cm", "centimeter", "centimeters", "centimetre", "centimetres"),
    "km": ("km", "kilometer", "kilometers", "kilometre", "kilometres"),
}


def accepted_units() -> str:
    """Return the names in `UNITS` as one line of text."""
    return ", ".join(UNITS)


def metres_per(unit: str) -> float:
    """Return the length of `unit` in metres.

    Raises
    ------
    DivespotError
        If `unit` is not in `UNITS`.
    """
    try:
        return UNITS[unit]
    except (KeyError, TypeError):
        raise DivespotError(
            f"unit is {str(unit)[:40]!r}: one of auto, {accepted_units()} is needed"
        ) from None


def unit_named(name: str) -> str | None:
    """Return the unit that a reference system calls `name`; None if it is not in `UNITS`."""
    word = re.sub(r"[^a-z]", "", name.lower())
    return next((unit for unit, names in _SPELLINGS.items() if word in names), None)


def unit_of(factor_m: float) -> str:
    """Return the unit that is `factor_m` metres long, or the factor as text.

    International and US survey foot differ by 2e-6; files give them to 1e-9 or better.
    """
    for name, metres in UNITS.items():
        if math.isclose(factor_m, metres, rel_tol=1e-7):
            return name
    return f"units of {factor_m!r} m"
