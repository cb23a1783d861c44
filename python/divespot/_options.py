"""Dataclass fields for settings, each with its check, its help text and the values it accepts."""

from __future__ import annotations

import dataclasses
import inspect
import json
import math
import numbers
import os
import re
from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Any, TypeVar

import numpy as np

from divespot._arguments import shown
from divespot.base_name import NEEDED, PLAIN, BaseName
from divespot.directions import UPWARD, parse_up
from divespot.errors import DivespotError

T = TypeVar("T")

#: Converts a value that was given to a plain one; returns None if it cannot.
Convert = Callable[[Any], Any]


def _option(default: Any, text: str, needed: str, convert: Convert, **more: Any) -> Any:  # noqa: ANN401 - a field of any type
    derivable = more.get("derivable", default is None)

    def plain(name: str, value: Any) -> Any:  # noqa: ANN401
        if value is None and derivable:
            return None
        converted = convert(value)
        if converted is None:
            raise DivespotError(f"{name} is {shown(value)}: {needed} is needed")
        return converted

    metadata = {"help": text, "needed": needed, "plain": plain, **more}
    return field(default=default, metadata=metadata)


class Checked:
    """A record that checks its fields' values."""

    def __post_init__(self) -> None:
        """Check every value, and convert NumPy's numbers to plain Python ones."""
        record: Any = self
        for item in dataclasses.fields(record):
            plain = item.metadata["plain"](item.name, getattr(self, item.name))
            object.__setattr__(self, item.name, plain)


def described(cls: type[T]) -> type[T]:
    """Add each field's meaning and the values it accepts to a record's docstring."""
    record: Any = cls
    lines = [inspect.cleandoc(cls.__doc__ or ""), "", "Attributes", "----------"]
    for item in dataclasses.fields(record):
        default = repr(item.default).partition("(")[0]
        takes = item.metadata["needed"].rstrip(",")
        text = item.metadata["help"]
        lines += [item.name, f"    {text[0].upper()}{text[1:]}.", f"    Takes {takes}."]
        lines.append(f"    Default: {default}.")
    cls.__doc__ = "\n".join(lines)
    return cls


def _real(value: Any) -> float | None:  # noqa: ANN401
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def length(text: str, default: float | None = None, *, derivable: bool | None = None) -> Any:  # noqa: ANN401
    """Return a field for a finite number of 0 or more; None, if allowed: derived from the scan."""
    may_wait = default is None if derivable is None else derivable
    needed = "a finite number of 0 or more"
    return _option(
        default,
        text,
        needed,
        lambda v: None if (x := _real(v)) is None or x < 0 else x,
        kind=float,
        derivable=may_wait,
    )


def positive(text: str, default: float | None = None, most: float = math.inf) -> Any:  # noqa: ANN401
    """Return a field for a finite number above 0, up to `most`; None: derived from the scan."""
    needed = "a finite number above 0" + (f" and up to {most:g}" if most < math.inf else "")
    return _option(
        default,
        text,
        needed,
        lambda v: x if (x := _real(v)) is not None and 0 < x <= most else None,
        kind=float,
    )


def count(text: str, default: int, least: int, most: int = 2**32 - 1) -> Any:  # noqa: ANN401
    """Return a field for a whole number from `least` to `most`."""

    def convert(value: Any) -> int | None:  # noqa: ANN401
        whole = isinstance(value, numbers.Integral) and not isinstance(value, bool)
        return int(value) if whole and least <= value <= most else None

    return _option(default, text, f"a whole number from {least} to {most}", convert, kind=int)


def text(help_text: str, default: str | None, **more: Any) -> Any:  # noqa: ANN401
    """Return a field for a text; None, allowed if it is the default, means none."""
    return _option(default, help_text, "a text", _text, kind=str, **more)


def _text(value: Any) -> str | None:  # noqa: ANN401
    return value if isinstance(value, str) else None


def listed(help_text: str, needed: str, pattern: str) -> Any:  # noqa: ANN401
    """Return a field for comma-separated words that match a pattern; None means none."""
    matches = re.compile(pattern).fullmatch
    return _option(
        None,
        help_text,
        needed,
        lambda v: v if isinstance(v, str) and matches(v) else None,
        kind=str,
        metavar="LIST",
    )


def flag(help_text: str, *, default: bool = False) -> Any:  # noqa: ANN401
    """Return a field for a switch."""
    return _option(
        default,
        help_text,
        "True or False",
        lambda v: bool(v) if isinstance(v, bool | np.bool_) else None,
        kind=bool,
    )


def choice(help_text: str, *choices: str, default: str | None = "") -> Any:  # noqa: ANN401
    """Return a field for one of several words, by default the first or None."""
    return _option(
        choices[0] if default == "" else default,
        help_text,
        f"one of {', '.join(choices)}",
        lambda v: v if _text(v) in choices else None,
        kind=str,
        choices=choices,
    )


def base(help_text: str) -> Any:  # noqa: ANN401
    """Return a field for the name of a base."""
    return _option(
        PLAIN[0],
        help_text,
        NEEDED,
        lambda v: v if isinstance(v, str) and BaseName.parse(v) else None,
        kind=str,
        metavar="NAME",
    )


def direction(help_text: str) -> Any:  # noqa: ANN401
    """Return a field for a direction; by default it is taken from the scan."""
    return _option(
        "auto", help_text, UPWARD, _direction, kind=str, metavar="auto|x|y|z|-x|-y|-z|A,B,C"
    )


def _direction(value: Any) -> str | tuple[float, ...] | None:  # noqa: ANN401
    if isinstance(value, str):
        try:
            parse_up(value)
        except DivespotError:
            return None
        return value
    found = _numbers(value, 3)
    return found if found and any(found) else None


def record(help_text: str, kind: type[Any]) -> Any:  # noqa: ANN401
    """Return a field for a nested record, which may be given as a dict of its fields."""

    def convert(value: Any) -> Any:  # noqa: ANN401
        if not isinstance(value, Mapping):
            return value if isinstance(value, kind) else None
        known = [item.name for item in dataclasses.fields(kind)]
        return kind(**value) if set(value) <= set(known) else None

    needed = f"a divespot.{kind.__name__}, or a dict of some of its fields"
    return _option(kind(), help_text, needed, convert, kind=kind)


def outlines(help_text: str) -> Any:  # noqa: ANN401
    """Return a field for the path of a file, or the file's content as a dict; None means none."""
    needed = "a path, or GeoJSON as a dict,"
    return _option(None, help_text, needed, _path_or_dict, kind=str, metavar="FILE")


def _path_or_dict(value: Any) -> str | dict[str, Any] | None:  # noqa: ANN401
    if not isinstance(value, Mapping):
        return _path(value)
    try:
        # Tuples and NumPy's numbers, as geometry libraries give them, become JSON's own types.
        plain: dict[str, Any] = json.loads(json.dumps({**value}, default=float))
    except (TypeError, ValueError, RecursionError):
        return None
    return plain or None


def _path(value: Any) -> str | None:  # noqa: ANN401
    return (os.fsdecode(value) or None) if isinstance(value, str | os.PathLike) else None


def box(help_text: str, axes: str) -> Any:  # noqa: ANN401
    """Return a field for two corners of an axis-aligned box; None means none."""
    names = [f"{axis}{end}" for end in (0, 1) for axis in axes]
    least = " and ".join(f"{axis}0 <= {axis}1" for axis in axes)
    return _option(
        None,
        help_text,
        f"{','.join(names)} with {least}",
        lambda v: _box(v, len(names)),
        kind=tuple,
        metavar=",".join(names).upper(),
    )


def _box(value: Any, count: int) -> tuple[float, ...] | None:  # noqa: ANN401
    found = _numbers(value, count)
    half = count // 2
    return found if found and all(map(float.__le__, found[:half], found[half:])) else None


def _numbers(value: Any, many: int) -> tuple[float, ...] | None:  # noqa: ANN401
    """Return `many` finite numbers; None if the value is anything else."""
    try:
        given = [_real(v) for v in value]
    except TypeError:
        return None
    found = tuple(v for v in given if v is not None)
    return found if len(given) == len(found) == many else None
