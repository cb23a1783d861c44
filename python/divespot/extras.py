"""Packages that belong to an extra, imported where they are used."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from divespot.errors import DivespotError


def is_installed(module: str) -> bool:
    """Return whether a module of an extra is installed."""
    try:
        import_module(module)
    except ImportError:
        return False
    return True


def extra(module: str, name: str, need: str) -> Any:  # noqa: ANN401 - a module, which may be absent
    """Return a module of the extra `name`.

    Raises
    ------
    DivespotError
        The module is not installed; `need` says what it is needed for.

    """
    try:
        return import_module(module)
    except ImportError:
        raise DivespotError(
            f"{need}, which is not installed: pip install divespot[{name}] is needed"
        ) from None
