"""A history of measurements in one SQLite file."""

from __future__ import annotations

import sqlite3
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from divespot import _native
from divespot.errors import DivespotError, encodable
from divespot.output import HISTORY, refuse_inputs, require_own
from divespot.results.csv_rows import now

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator

    from divespot.report import Report

#: SQLite's application id in the file's header, by which divespot recognizes its own files.
APPLICATION = int.from_bytes(b"dvsp", "big")

_TABLES = f"""
PRAGMA application_id = {APPLICATION};
PRAGMA user_version = 1;
CREATE TABLE measurements (
  id INTEGER PRIMARY KEY, time TEXT NOT NULL, site TEXT NOT NULL, scan TEXT,
  volume_m3 REAL, u95_m3 REAL, mass_kg REAL, u95_mass_kg REAL, piles INTEGER NOT NULL,
  divespot TEXT NOT NULL, report TEXT NOT NULL);
CREATE TABLE piles (
  measurement INTEGER NOT NULL REFERENCES measurements(id), pile INTEGER NOT NULL, name TEXT,
  volume_m3 REAL, u95_m3 REAL, mass_kg REAL, u95_mass_kg REAL, footprint_m2 REAL,
  max_height_m REAL, centroid_x REAL, centroid_y REAL, centroid_z REAL,
  PRIMARY KEY (measurement, pile));
"""


@dataclass(frozen=True)
class Past:
    """The total of a measurement, and its time (ISO 8601, UTC)."""

    time: str
    volume_m3: float
    u95_m3: float


@dataclass(frozen=True)
class Entry(Past):
    """A measurement in a history; `report` is its JSON."""

    id: int
    site: str
    scan: str | None
    piles: int
    mass_kg: float | None
    u95_mass_kg: float | None
    report: str


def add(
    report: Report, path: str | os.PathLike[str], *, site: str = "", time: str | None = None
) -> int:
    """Add a measurement to a history, which is created if missing; return its number.

    Raises
    ------
    DivespotError
        The file was not written by divespot, or cannot be written.

    """
    refuse_inputs(path, "the history", report.inputs)
    require_own(path, HISTORY, "the history")
    total = report.total
    scan = encodable(report.source.path)
    row = (time or now(), site, scan, *vars(total).values(), len(report.piles))
    with _opened(path, begin=True) as base:
        marks = ", ".join("?" * (len(row) + 2))
        names = "time, site, scan, volume_m3, u95_m3, mass_kg, u95_mass_kg, piles, divespot, report"
        cursor = base.execute(
            f"INSERT INTO measurements ({names}) VALUES ({marks})",  # noqa: S608 - our own names
            (*row, _native.__version__, report.to_json(indent=None)),
        )
        number = int(cursor.lastrowid or 0)
        base.executemany(
            f"INSERT INTO piles VALUES ({', '.join('?' * 12)})",  # noqa: S608 - as above
            [_pile_row(number, pile) for pile in report.piles],
        )
    return number


def _pile_row(number: int, pile: Any) -> tuple[Any, ...]:  # noqa: ANN401 - a pile
    measured = (pile.volume_m3, pile.u95_m3, pile.mass_kg, pile.u95_mass_kg)
    return (
        *(number, pile.id, encodable(pile.name), *measured),
        *(pile.footprint_m2, pile.max_height_m, *pile.centroid_m),
    )


def entries(path: str | os.PathLike[str], site: str | None = None) -> list[Entry]:
    """Return the measurements of a history, or those of one site, in order of time.

    Raises
    ------
    DivespotError
        The file does not exist, or is not a history.

    """
    if not Path(path).is_file():
        raise DivespotError(f"{path}: there is no such file: a history is needed")
    require_own(path, HISTORY, "a measurement")
    names = "time, volume_m3, u95_m3, id, site, scan, piles, mass_kg, u95_mass_kg, report"
    query = f"SELECT {names} FROM measurements WHERE ? IS NULL OR site = ? ORDER BY time, id"  # noqa: S608
    with _opened(path, begin=False) as base:
        return [Entry(*row) for row in base.execute(query, (site, site))]


def past(path: str | os.PathLike[str], site: str = "") -> tuple[Past, ...]:
    """Return the totals of a site so far; empty if there is no history yet."""
    return tuple(entries(path, site)) if Path(path).is_file() and Path(path).stat().st_size else ()


@contextmanager
def _opened(path: str | os.PathLike[str], *, begin: bool) -> Iterator[sqlite3.Connection]:
    """Open a history for one transaction, which is written whole or not at all."""
    try:
        with closing(sqlite3.connect(path)) as base, base:
            if begin and not base.execute("PRAGMA schema_version").fetchone()[0]:
                base.executescript(_TABLES)
            yield base
    except (sqlite3.Error, ValueError, TypeError) as error:
        raise DivespotError(f"{path}: cannot be used ({error}): a history is needed") from None
