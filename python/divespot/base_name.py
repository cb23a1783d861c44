"""The names of base surfaces, as users type them."""

from __future__ import annotations

import math
from dataclasses import dataclass

#: Bases that need only the scan.
PLAIN = ("local", "plane", "peak", "midpeak")

NEEDED = f"one of {', '.join(PLAIN)}, height=H, camera-height=H, surface=FILE"


@dataclass(frozen=True)
class BaseName:
    """A base: its kind, with its number or file where it has one."""

    kind: str
    height: float = math.nan
    path: str = ""

    @classmethod
    def parse(cls, text: str) -> BaseName | None:
        """Return the base that `text` names; None if it names none.

        ``local``, ``plane``, ``peak``, ``midpeak``, ``height=H``, ``camera-height=H`` with a
        height above 0, ``surface=FILE``.
        """
        kind, separator, value = text.partition("=")
        if not separator:
            return cls(kind) if kind in PLAIN else None
        if kind == "surface":
            return cls(kind, path=value) if value else None
        height = _number(value)
        lowest = {"height": -math.inf, "camera-height": 0.0}.get(kind, math.inf)
        return cls(kind, height=height) if lowest < height < math.inf else None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
