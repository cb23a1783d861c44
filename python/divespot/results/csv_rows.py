"""A CSV file of measurements: one row per pile."""

from __future__ import annotations

import csv
import io
import os
from datetime import datetime, timezone
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError, encodable, unreadable
from divespot.output import append_line, refuse_inputs, write_text
from divespot.results.crs_name import crs_name

if TYPE_CHECKING:
    from collections.abc import Iterable

    from divespot.report import Pile, Report

#: Units are in the names; positions are in the scan's own frame and unit, named by `scan_unit`.
COLUMNS = (
    *("time", "scan", "scan_unit", "crs", "pile", "name", "material"),
    *("volume_m3", "u95_m3", "cut_m3", "fill_m3", "mass_kg", "u95_mass_kg"),
    *("footprint_m2", "max_height_m", "centroid_x", "centroid_y", "centroid_z"),
    *("seen_fraction", "touches_edge", "leans_on_wall", "base", "remarks"),
)

#: Columns with the same name as the pile's field.
_OWN = (
    *(name for name in COLUMNS if name.endswith(("_m3", "_kg", "_m2", "_m"))),
    *("name", "seen_fraction", "touches_edge", "leans_on_wall", "base"),
)

NO_PILE = "no pile was found"


def now() -> str:
    """Return the time in UTC (ISO 8601)."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


def rows_of(report: Report, time: str | None = None) -> list[dict[str, Any]]:
    """Return one row per pile, or a single row that says that there is none."""
    source = report.source
    common = {
        "time": now() if time is None else time,
        "scan": encodable(source.path),
        "scan_unit": source.unit,
        "crs": crs_name(source.crs),
    }
    if not report.piles:
        return [{**common, "material": report.settings.material, "remarks": NO_PILE}]
    return [{**common, **_own(pile)} for pile in report.piles]


def failed_row(scan: str, sentence: str) -> dict[str, Any]:
    """Return the row of a scan that could not be measured."""
    path = os.fsencode(scan).decode("utf-8", "replace")
    return {"time": now(), "scan": path, "remarks": sentence}


def _own(pile: Pile) -> dict[str, Any]:
    x, y, z = pile.centroid_m
    return {
        "pile": pile.id,
        **{name: getattr(pile, name) for name in _OWN},
        "name": encodable(pile.name),
        "material": encodable(pile.material),
        "centroid_x": x,
        "centroid_y": y,
        "centroid_z": z,
    }


def text_of(rows: Iterable[dict[str, Any]], *, header: bool) -> str:
    """Return rows as CSV (RFC 4180, except for line ends)."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    if header:
        writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def save_csv(
    report: Report, path: str | os.PathLike[str], *, append: bool = False, time: str | None = None
) -> None:
    """Write one row per pile, or append them to an existing file.

    Raises
    ------
    DivespotError
        The file cannot be written, or has other columns.

    """
    refuse_inputs(path, "the table", report.inputs)
    write_rows(path, rows_of(report, time), append=append)


def write_rows(
    path: str | os.PathLike[str], rows: Iterable[dict[str, Any]], *, append: bool
) -> None:
    """Write rows under a header, or append them to a file with the same columns."""
    if append and _is_begun(path):
        append_line(path, text_of(rows, header=False))
    else:
        write_text(path, text_of(rows, header=True))


def _is_begun(path: str | os.PathLike[str]) -> bool:
    try:
        with open(path, encoding="utf-8") as file:  # noqa: PTH123 - any path
            found = file.readline()
    except FileNotFoundError:
        return False
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from None
    if found and found != text_of((), header=True):
        raise DivespotError(
            f"{path}: has other columns than divespot writes: another name, or no --append, is "
            "needed"
        )
    return bool(found)
