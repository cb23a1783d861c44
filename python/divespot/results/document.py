"""The content of a report page, independent of its format."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from divespot import _native
from divespot.errors import printable
from divespot.mass import density_of
from divespot.numbers import rounded, with_uncertainty
from divespot.report import COVERAGE
from divespot.results.crs_name import crs_name
from divespot.results.csv_rows import now
from divespot.results.history import Past
from divespot.results.show_units import KG_PER_T, Shown
from divespot.results.telling import scan_name
from divespot.results.trust import trust_sentence
from divespot.results.wording import texts

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from divespot.intake import Source
    from divespot.report import Pile, Report, Total
    from divespot.settings import Settings

T = TypeVar("T")

#: From this mass on, in kg, tonnes are shown.
TONNES_FROM_KG = 1000.0

#: Number of bytes of a file that are hashed at a time.
_BLOCK = 1 << 20


@dataclass(frozen=True)
class Cell:
    """A text, and the number of the JSON that it shows."""

    text: str
    value: float | int | None = None


@dataclass(frozen=True)
class Table:
    """A header and rows; `total` is shown below them."""

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    total: tuple[Cell, ...] = ()


@dataclass(frozen=True)
class Survey:
    """Information about a survey that is not in the report.

    Attributes
    ----------
    site
        Name of the site; by default the name of the scan.
    date
        Time of the measurement (ISO 8601).
    past
        Earlier surveys of the site, the latest one last.

    """

    site: str | None = None
    date: str | None = None
    past: tuple[Past, ...] = ()

    def with_now(self, report: Report) -> tuple[Past, ...]:
        """Return all surveys, the present one last."""
        total = report.total
        return *self.past, Past(self.date or now(), total.volume_m3, total.u95_m3)


@dataclass(frozen=True)
class Document:
    """The page's parts in reading order."""

    texts: Mapping[str, Any]
    title: str
    facts: tuple[tuple[str, str], ...]
    piles: Table
    trust: str
    change: str | None
    filled: Table | None
    left_out: Table | None
    warnings: tuple[str, ...]
    provenance: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, str], ...]
    more_sections: str | None = field(default=None)

    @classmethod
    def of(cls, report: Report, survey: Survey, most_sections: int) -> Document:
        """Return the page's parts for a report."""
        words, shown = texts(), Shown.of(report)
        date = survey.date or now()
        count = len(report.piles)
        more = words["sections_more"].format(all=count, shown=most_sections)
        return cls(
            texts=words,
            title=printable(survey.site or Path(scan_name(report.source)).stem),
            facts=_facts(report, day_of(date), words),
            piles=_piles(report, shown, words),
            trust=trust_sentence(report, shown, words),
            change=_change(report, shown, survey, words),
            filled=_filled(report, shown, words),
            left_out=_left_out(report, shown, words),
            warnings=tuple(map(printable, report.warnings)),
            provenance=_provenance(report, day_of(date), words),
            settings=settings_told(report.settings),
            more_sections=more if count > most_sections else None,
        )


def day_of(time: str) -> str:
    """Return an ISO 8601 time as text for people."""
    return time.replace("T", " ").replace("+00:00", " UTC")


def _facts(report: Report, date: str, words: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    source, settings = report.source, report.settings
    materials = [pile.material for pile in report.piles] or [settings.material]
    facts = [
        (words["date"], date),
        (words["scan"], scan_name(report.source)),
        (words["points"], f"{source.points:,}"),
        (
            words["system"],
            printable(crs_name(source.crs) or "") or words["system_none"].format(unit=source.unit),
        ),
        (words["material"], printable(", ".join(_known(materials)) or words["material_none"])),
    ]
    if densities := _known(density_of(material, settings) for material in materials):
        told = (
            words["density_value"].format(density=rounded(kg_m3, 4), u95=rounded(COVERAGE * u, 2))
            for kg_m3, u in densities
        )
        facts.append((words["density"], ", ".join(told)))
    return tuple(facts)


def _known(values: Iterable[T | None]) -> list[T]:
    """Return each value that is not None once."""
    return [value for value in dict.fromkeys(values) if value is not None]


def _piles(report: Report, shown: Shown, words: Mapping[str, Any]) -> Table:
    items: Sequence[Pile | Total] = (*report.piles, report.total)
    named = any(pile.name for pile in report.piles)
    weighed = any(item.mass_kg is not None for item in items)
    tonnes = max((abs(item.mass_kg or 0.0) for item in items), default=0.0) >= TONNES_FROM_KG
    unit, kg = ("t", KG_PER_T) if tonnes else ("kg", 1.0)

    def first(item: Pile | Total) -> list[Cell]:
        cells = [Cell(shown.measured(item), item.volume_m3)]
        if weighed:
            cells.append(Cell(_mass(item, kg), item.mass_kg))
        return cells

    def row(pile: Pile) -> tuple[Cell, ...]:
        remarks = ((pile.touches_edge, "runs_out"), (pile.leans_on_wall, "leans"))
        return (
            Cell(str(pile.id), pile.id),
            *([Cell(printable(pile.name or ""))] if named else []),
            *first(pile),
            Cell(rounded(pile.footprint_m2), pile.footprint_m2),
            Cell(rounded(pile.max_height_m), pile.max_height_m),
            Cell(f"{pile.seen_fraction:.0%}", pile.seen_fraction),
            Cell(", ".join(words[name] for is_so, name in remarks if is_so)),
        )

    name, mass = [words["name"]] if named else [], [f"{words['mass']} {unit}"] if weighed else []
    sizes = (words["area"], words["height"], words["seen"], words["remarks"])
    header = (words["pile"], *name, f"{words['volume']} {shown.unit}", *mass, *sizes)
    empty = [Cell("")] * len(sizes)
    total = (Cell(words["total"]), *([Cell("")] if named else []), *first(report.total), *empty)
    return Table(header, tuple(map(row, report.piles)), total)


def _mass(item: Pile | Total, kg: float) -> str:
    if item.mass_kg is None:
        return "-"
    return with_uncertainty(item.mass_kg / kg, (item.u95_mass_kg or 0.0) / kg)


def _change(report: Report, shown: Shown, survey: Survey, words: Mapping[str, Any]) -> str | None:
    if not survey.past:
        return None
    last = survey.past[-1]
    change = shown.per_m3 * (report.total.volume_m3 - last.volume_m3)
    u95 = shown.per_m3 * math.hypot(report.total.u95_m3, last.u95_m3)
    told = with_uncertainty(abs(change), u95)
    sign = "-" if change < 0 else "+"
    sentence = words["change_sentence"]
    return str(sentence.format(sign=sign, volume=told, unit=shown.unit, date=last.time[:10]))


def _filled(report: Report, shown: Shown, words: Mapping[str, Any]) -> Table | None:
    rows = [
        (
            Cell(str(pile.id), pile.id),
            Cell(f"{1.0 - pile.seen_fraction:.1%}"),
            Cell(rounded((1.0 - pile.seen_fraction) * pile.footprint_m2)),
            Cell(rounded(shown.per_m3 * COVERAGE * pile.budget.filled_m3, 2)),
        )
        for pile in report.piles
        if pile.seen_fraction < 1.0
    ]
    header = (
        *(words["pile"], words["filled_share"], words["filled_area"]),
        f"{words['filled_u95']} {shown.unit}",
    )
    return Table(header, tuple(rows)) if rows else None


def _left_out(report: Report, shown: Shown, words: Mapping[str, Any]) -> Table | None:
    rows = [
        (
            Cell(str(item.id), item.id),
            Cell(str(item.reason)),
            Cell(shown.measured(item), item.volume_m3),
            Cell(rounded(item.footprint_m2)),
            Cell(rounded(item.max_height_m)),
        )
        for item in report.other_objects
    ]
    volume = f"{words['volume']} {shown.unit}"
    header = (words["object"], words["reason"], volume, words["area"], words["height"])
    return Table(header, tuple(rows)) if rows else None


def _provenance(report: Report, date: str, words: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    source = report.source
    return (
        *files_told(report.source, words),
        (words["version"], _native.__version__),
        (words["seed"], str(report.seed)),
        (words["measured_on"], date),
        (words["dropped"], f"{source.dropped_nonfinite + source.dropped_zero:,}"),
        (words["base_rule"], printable(report.settings.base)),
    )


def files_told(source: Source, words: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return each file of a scan with its hash."""
    of_files = (
        (
            (words["file"], printable(p or "-")),
            (words["sha256"], file_hash(p) or words["sha256_none"]),
        )
        for p in source.files or (source.path,)
    )
    return list(chain.from_iterable(of_files))


def file_hash(path: str | None) -> str | None:
    """Return the SHA-256 of a file; None if it can no longer be read."""
    if path is None:
        return None
    digest = hashlib.sha256()
    try:
        with Path(path).open("rb") as file:
            while block := file.read(_BLOCK):
                digest.update(block)
    except (OSError, ValueError):
        return None
    return digest.hexdigest()


def settings_told(settings: Settings) -> tuple[tuple[str, str], ...]:
    """Return the settings that were used, including those of the stages."""
    values = dataclasses.asdict(settings)
    values.update(values.pop("stages"))
    return tuple((name, _told(value)) for name, value in values.items() if value is not None)


def _told(value: Any) -> str:  # noqa: ANN401 - any setting
    if isinstance(value, bool):
        return "on" if value else "off"
    return rounded(value, 4) if isinstance(value, float) else printable(str(value))
