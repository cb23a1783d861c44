"""Checks of the fields of a scene's records."""

from __future__ import annotations

import math

from divespot.errors import DivespotError


def require(holds: bool, sentence: str) -> None:  # noqa: FBT001 (a condition, not an option)
    """Raise unless a condition holds."""
    if not holds:
        raise DivespotError(sentence)


def require_positive(owner: object, *names: str) -> None:
    """Raise unless the named fields are finite and above 0."""
    for name in names:
        value = getattr(owner, name)
        require(
            math.isfinite(value) and value > 0,
            f"{type(owner).__name__}.{name} is {value}: a number above 0 is needed",
        )


def require_not_negative(owner: object, *names: str) -> None:
    """Raise unless the named fields are finite and 0 or more."""
    for name in names:
        value = getattr(owner, name)
        require(
            math.isfinite(value) and value >= 0,
            f"{type(owner).__name__}.{name} is {value}: a number of 0 or more is needed",
        )


def require_share(owner: object, *names: str) -> None:
    """Raise unless the named fields are shares from 0 to below 1."""
    for name in names:
        value = getattr(owner, name)
        require(
            0 <= value < 1,
            f"{type(owner).__name__}.{name} is {value}: a share from 0 to below 1 is needed",
        )
