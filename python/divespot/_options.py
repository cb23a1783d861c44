"""Fields of a settings class that say what they accept."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import field
from typing import Any

from divespot.errors import DivespotError

Check = Callable[[object], bool]


def _option(default: Any, text: str, needed: str, accepts: Check, **more: Any) -> Any:  # noqa: ANN401 - a field of any type
    def check(name: str, value: object) -> None:
        if not accepts(value):
            raise DivespotError(f"{name} is {value!r}: {needed} is needed")

    return field(default=default, metadata={"help": text, "check": check, **more})


def _is_real(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def length(text: str, default: float | None = None) -> Any:  # noqa: ANN401
    """Return a field for a length of 0 or more; None waits for the scan."""
    return _number(text, default, "a finite length of 0 or more", lambda v: v >= 0, float)


def positive(text: str, default: float | None = None) -> Any:  # noqa: ANN401
    """Return a field for a number above 0; None waits for the scan."""
    return _number(text, default, "a finite number above 0", lambda v: v > 0, float)


def count(text: str, default: int, least: int) -> Any:  # noqa: ANN401
    """Return a field for a whole number."""
    needed = f"a whole number of {least} or more"
    return _number(text, default, needed, lambda v: isinstance(v, int) and v >= least, int)


def _number(
    text: str,
    default: float | None,
    needed: str,
    accepts: Callable[[float], bool],
    kind: type,
) -> Any:  # noqa: ANN401
    def check(value: object) -> bool:
        if value is None:
            return default is None or kind is float
        return _is_real(value) and accepts(value)  # type: ignore[arg-type] # a number by now

    return _option(default, text, needed, check, kind=kind)


def text(help_text: str, default: str) -> Any:  # noqa: ANN401
    """Return a field for a text."""
    return _option(default, help_text, "a text", lambda v: isinstance(v, str), kind=str)


def flag(help_text: str) -> Any:  # noqa: ANN401
    """Return a field for a switch that is off."""
    return _option(False, help_text, "True or False", lambda v: isinstance(v, bool), kind=bool)  # noqa: FBT003


def choice(help_text: str, *choices: str) -> Any:  # noqa: ANN401
    """Return a field for one of several words, the first by default."""
    needed = f"one of {', '.join(choices)}"
    return _option(choices[0], help_text, needed, choices.__contains__, kind=str, choices=choices)


def box(help_text: str) -> Any:  # noqa: ANN401
    """Return a field for an axis-aligned box; None for none."""

    def accepts(value: object) -> bool:
        if value is None:
            return True
        if not isinstance(value, tuple) or len(value) != 6 or not all(map(_is_real, value)):
            return False
        return all(low <= high for low, high in zip(value[:3], value[3:], strict=True))

    needed = "x0,y0,z0,x1,y1,z1 with each first number no larger than its second"
    return _option(None, help_text, needed, accepts, kind=tuple)
