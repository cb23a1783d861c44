"""A report as a data frame."""

from __future__ import annotations

from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from divespot.report import Pile, Report

#: Fields of a pile with more than one value.
_NESTED = ("centroid_m", "outline_m", "budget", "volume_by_base_m3")


def dataframe(report: Report) -> Any:  # noqa: ANN401 - of pandas or polars, which may be absent
    """Return a row for each pile and each other object.

    Raises
    ------
    DivespotError
        Neither pandas nor polars is installed.

    """
    rows = [_row(item) for item in (*report.piles, *report.other_objects)]
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {name: [row.get(name) for row in rows] for name in names}
    return _library().DataFrame(columns)


def _library() -> Any:  # noqa: ANN401 - as above
    for name in ("pandas", "polars"):
        with suppress(ImportError):
            return import_module(name)
    raise DivespotError("neither pandas nor polars is installed: one is needed for a data frame")


def _row(item: Pile) -> dict[str, Any]:
    own = {name: value for name, value in vars(item).items() if name not in _NESTED}
    place = dict(zip(("centroid_x", "centroid_y", "centroid_z"), item.centroid_m, strict=True))
    budget = {f"budget_{name}": value for name, value in vars(item.budget).items()}
    bases = {f"above_{name}_m3": v for name, v in (item.volume_by_base_m3 or {}).items()}
    return {**own, **place, **budget, **bases}
