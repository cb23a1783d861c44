"""Numbers formatted for people, with no more digits than are significant."""

from __future__ import annotations

import math

#: Smaller volumes are shown in litres.
SMALLEST_IN_M3 = 0.01
LITRES_PER_M3 = 1000.0


def volume_unit(largest_m3: float) -> tuple[str, float]:
    """Return the unit that suits volumes up to `largest_m3`, and how many make a cubic metre."""
    return ("L", LITRES_PER_M3) if abs(largest_m3) < SMALLEST_IN_M3 else ("m³", 1.0)


def with_uncertainty(value: float, u95: float) -> str:
    """Return ``value ± u95``, rounded to two digits of the uncertainty (GUM 7.2.6)."""
    if not (math.isfinite(u95) and u95 > 0.0):
        return f"{rounded(value, 4)} ± {u95:.2g}"
    decimals = 1 - math.floor(math.log10(u95))
    return f"{_fixed(value, decimals)} ± {_fixed(u95, decimals)}"


def rounded(value: float, digits: int = 3) -> str:
    """Return a number with `digits` significant digits, never in scientific notation."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value + 0.0:g}"
    return _fixed(value, digits - 1 - math.floor(math.log10(abs(value))))


def _fixed(value: float, decimals: int) -> str:
    # Adding 0 turns -0.0 into 0.0.
    return f"{round(value, decimals) + 0.0:.{max(decimals, 0)}f}"
