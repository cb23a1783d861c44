"""Real scans of known volume, listed in a CSV file."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from divespot._arguments import require_kind
from divespot.errors import DivespotError
from divespot.evaluate.outcome import Outcome, PileOutcome
from divespot.io.files import bytes_of
from divespot.pipeline import measure
from divespot.settings import Settings

if TYPE_CHECKING:
    import os

    from divespot.report import Report

#: Largest size of a list of scans, in bytes.
LARGEST_BYTES = 64 << 20

COLUMNS = ("path", "volume_m3")
"""Columns that the list must have, one row per pile; `unit` is optional."""


@dataclass(frozen=True)
class KnownRound:
    """A real scan, and the volumes of its piles, largest first."""

    path: str
    volumes_m3: tuple[float, ...]
    settings: Settings
    changed_ns: int
    """Time of the last change of the file; a kept result is valid only for that version."""

    def outcomes(self, result: dict[str, Any]) -> list[Outcome]:
        """Return the outcome in the result of `measure_known`."""
        return [Outcome.from_json(result)]


def read_list(path: str | os.PathLike[str], settings: Settings) -> list[KnownRound]:
    """Read a list of scans: CSV with a header, the columns path and volume_m3, optionally unit.

    Paths are relative to the list's folder; a scan of several piles has one row for each.

    Raises
    ------
    DivespotError
        The list or a scan is missing, a column is missing, or a volume is not a number above 0.

    """
    require_kind("settings", settings, Settings)
    scans: dict[tuple[Path, str], list[float]] = {}
    for number, row in enumerate(_rows(path), start=2):
        where = f"{path}, line {number}"
        scan = Path(path).parent / _cell(row, "path", where)
        if not scan.is_file():
            raise DivespotError(f"{where}: there is no file {scan}: a scan is needed")
        unit = row.get("unit") or settings.unit
        scans.setdefault((scan, unit), []).append(_volume(row, where))
    return [
        KnownRound(
            str(scan),
            tuple(sorted(volumes, reverse=True)),
            settings.changed(unit=unit),
            scan.stat().st_mtime_ns,
        )
        for (scan, unit), volumes in scans.items()
    ]


def _rows(path: str | os.PathLike[str]) -> list[dict[str, str]]:
    try:
        text = bytes_of(Path(path), LARGEST_BYTES).decode("utf-8-sig")
        rows = list(csv.DictReader(io.StringIO(text, newline="")))
    except (DivespotError, OSError, UnicodeDecodeError, csv.Error) as error:
        raise DivespotError(
            f"{path}: cannot be read ({error}): a list of scans is needed"
        ) from None
    if not rows:
        raise DivespotError(f"{path}: a header path,volume_m3 and one row per pile are needed")
    return rows


def _cell(row: dict[str, str], column: str, where: str) -> str:
    value = row.get(column)
    if not value:
        raise DivespotError(f"{where}: there is no {column}: columns {COLUMNS} are needed")
    return value


def _volume(row: dict[str, str], where: str) -> float:
    text = _cell(row, "volume_m3", where)
    try:
        volume = float(text)
    except ValueError:
        volume = math.nan
    if not (volume > 0.0 and math.isfinite(volume)):
        raise DivespotError(f"{where}: volume_m3 is {text!r}: a number above 0 is needed")
    return volume


def measure_known(one: KnownRound) -> dict[str, Any]:
    """Measure a real scan, for `run_rounds`."""
    begin = time.perf_counter()
    report, failure = None, None
    try:
        report = measure(one.path, one.settings)
    except DivespotError as error:
        failure = str(error)
    piles = _largest(one.volumes_m3, report)
    outcome = Outcome(
        scene=one.path,
        seed=None,
        voxel_m=0.0,
        points=report.source.points if report else 0,
        kept=1.0,
        piles=piles,
        extras=(),
        total=None,
        failure=failure,
        seconds=time.perf_counter() - begin,
    )
    return dataclasses.asdict(outcome)


def _largest(volumes_m3: tuple[float, ...], report: Report | None) -> tuple[PileOutcome, ...]:
    """Compare the known volumes with those of the largest objects, including other objects.

    A reference object may be a box, and its position is not known.
    """
    objects = (*report.piles, *report.other_objects) if report else ()
    found = sorted(objects, key=lambda item: item.volume_m3, reverse=True)
    missing = [None] * max(len(volumes_m3) - len(found), 0)
    return tuple(
        PileOutcome(truth_m3)
        if item is None
        else PileOutcome(truth_m3, item.volume_m3, item.u95_m3, item.reason)
        for truth_m3, item in zip(volumes_m3, [*found, *missing], strict=False)
    )
