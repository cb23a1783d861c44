"""Reading a report from its JSON."""

from __future__ import annotations

import json
import math
from typing import Any, TypeVar

from divespot.budget import Budget
from divespot.errors import DivespotError
from divespot.intake import Source
from divespot.report import SCHEMA, Ground, Pile, Report, Total
from divespot.settings import Settings

Kind = TypeVar("Kind", bound=Report)

#: Fields of a report that may be null; other nulls stand for NaN.
_MAY_BE_ABSENT = {
    *(
        "path",
        "crs",
        "base_from",
        "mass_kg",
        "u95_mass_kg",
        "volume_by_base_m3",
        "repeat_m3",
        "name",
        "material",
    ),
    "reason",
}


def parsed(text: str | bytes, kind: type[Kind]) -> Kind:
    """Return a report of the given class, without its levelled scene.

    Raises
    ------
    DivespotError
        The text is not JSON, or not a report of this schema.

    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise DivespotError(f"the report is no JSON ({error}): JSON is needed") from None
    schema = found.get("schema") if isinstance(found, dict) else None
    if schema != SCHEMA:
        raise DivespotError(f"the report's schema is {schema!r}: {SCHEMA} is needed")
    try:
        return _report(found, kind)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        what = error if isinstance(error, DivespotError) else f"{type(error).__name__}: {error}"
        raise DivespotError(f"the report is damaged ({what}): one as {SCHEMA} is needed") from None


def _report(found: dict[str, Any], kind: type[Kind]) -> Kind:
    settings = {name: _tuples(value) for name, value in found["settings"].items()}
    return kind(
        source=Source(**{name: _tuples(value) for name, value in found["source"].items()}),
        piles=tuple(_pile(pile) for pile in found["piles"]),
        other_objects=tuple(_pile(item) for item in found["other_objects"]),
        total=Total(**_numbers(found["total"])),
        ground=Ground(**_numbers(found["ground"])),
        settings=Settings(**settings),
        timings_s=dict(found["timings_s"]),
        warnings=tuple(found["warnings"]),
    )


def _pile(found: dict[str, Any]) -> Pile:
    whole = _numbers(found)
    return Pile(**{**whole, "budget": Budget(**_numbers(found["budget"]))})


def _numbers(found: dict[str, Any]) -> dict[str, Any]:
    """Return values as a dataclass has them: tuples for lists, NaN for null."""
    return {
        name: value if name in _MAY_BE_ABSENT else _tuples(math.nan if value is None else value)
        for name, value in found.items()
    }


def _tuples(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    if isinstance(value, list):
        return tuple(_tuples(math.nan if item is None else item) for item in value)
    return value
