"""The content of a comparison's report page, independent of its format."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from divespot import _native
from divespot.errors import printable
from divespot.numbers import rounded, volume_unit, with_uncertainty
from divespot.report import COVERAGE
from divespot.results.crs_name import crs_name
from divespot.results.csv_rows import now
from divespot.results.document import Cell, Table, day_of, files_told, settings_told
from divespot.results.show_units import VOLUMES
from divespot.results.telling import counted, scan_name
from divespot.results.wording import texts

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from divespot.results.comparison import Change, Comparison, Match, Place


@dataclass(frozen=True)
class Unit:
    """The unit in which volumes are shown."""

    sign: str
    per_m3: float

    @classmethod
    def of(cls, found: Comparison, name: str | None = None) -> Unit:
        """Return the unit of that name, or the one that suits the largest volume."""
        if name is not None:
            return cls(*VOLUMES[name])
        volumes = [abs(place.net.volume_m3) for place in found.places]
        volumes += [max(one.volume_before_m3, one.volume_after_m3) for one in found.piles]
        return cls(*volume_unit(max(volumes, default=1.0)))

    def told(self, change: Change) -> str:
        """Return a volume with its uncertainty, as text."""
        return with_uncertainty(self.per_m3 * change.volume_m3, self.per_m3 * change.u95_m3)

    def rounded(self, volume_m3: float) -> str:
        """Return a volume, as text."""
        return rounded(self.per_m3 * volume_m3)


@dataclass(frozen=True)
class ChangeDocument:
    """The page's parts in reading order."""

    texts: Mapping[str, Any]
    title: str
    facts: tuple[tuple[str, str], ...]
    total: Table
    trust: str
    places: Table | None
    piles: Table | None
    not_counted: Table | None
    warnings: tuple[str, ...]
    provenance: tuple[tuple[str, str], ...]
    settings: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, found: Comparison, unit: Unit, site: str | None = None) -> ChangeDocument:
        """Return the page's parts for a comparison."""
        words, date = texts(), day_of(now())
        return cls(
            texts=words,
            title=printable(site or Path(scan_name(found.source)).stem),
            facts=_facts(found, date, words),
            total=_total(found, unit, words),
            trust=_trust(found, unit, words),
            places=_places(found.places, unit, words) if found.places else None,
            piles=_piles(found.piles, unit, words) if found.piles else None,
            not_counted=_not_counted(found.not_counted, unit, words) if found.not_counted else None,
            warnings=tuple(map(printable, found.warnings)),
            provenance=_provenance(found, date, words),
            settings=settings_told(found.settings),
        )


def _facts(found: Comparison, date: str, words: Mapping[str, Any]) -> tuple[tuple[str, str], ...]:
    before, after = found.sources
    system = printable(crs_name(after.crs) or "")
    return (
        (words["date"], date),
        (words["survey_before"], scan_name(before)),
        (words["survey_after"], scan_name(after)),
        (words["system"], system or words["system_none"].format(unit=after.unit)),
        (words["points"], f"{before.points:,}; {after.points:,}"),
    )


def _total(found: Comparison, unit: Unit, words: Mapping[str, Any]) -> Table:
    def row(name: str) -> tuple[Cell, Cell]:
        change: Change = getattr(found, name)
        told = words["no_change"] if change.is_none else unit.told(change)
        return Cell(words[name]), Cell(told, change.volume_m3)

    header = (words["change_total"], f"{words['volume']} {unit.sign}")
    return Table(header, (row("gain"), row("loss")), row("net"))


def _trust(found: Comparison, unit: Unit, words: Mapping[str, Any]) -> str:
    alignment = found.alignment
    if not alignment.blocks:
        return str(words["change_trust_none"])
    offset = f"{rounded(alignment.offset_m, 2)} m"
    raised = words["raised"].format(offset=offset) if found.aligned else words["not_raised"]
    spread = f"{rounded(alignment.spread_m, 2)} m"
    what = words["change_none"] if found.net.is_none else _between(found.net, unit, words)
    return str(words["change_trust"]).format(found=what, spread=spread, raised=raised)


def _between(net: Change, unit: Unit, words: Mapping[str, Any]) -> str:
    ends = (unit.per_m3 * (net.volume_m3 + sign * net.u95_m3) for sign in (-1.0, 1.0))
    low, high = (with_uncertainty(end, unit.per_m3 * net.u95_m3).partition(" ")[0] for end in ends)
    return str(words["change_found"]).format(low=low, high=high, unit=unit.sign)


def _places(places: Sequence[Place], unit: Unit, words: Mapping[str, Any]) -> Table:
    names = (words[name] for name in ("gain", "loss", "net", "limit"))
    header = (
        *(words["place"], *(f"{name} {unit.sign}" for name in names)),
        *(words["area"], words["on_pile"], words["pile_was"]),
    )
    return Table(header, tuple(_place(place, unit) for place in places))


def _place(place: Place, unit: Unit) -> tuple[Cell, ...]:
    return (
        Cell(str(place.id), place.id),
        Cell(unit.rounded(place.gain_m3), place.gain_m3),
        Cell(unit.rounded(place.loss_m3), place.loss_m3),
        Cell(unit.told(place.net), place.net.volume_m3),
        Cell(rounded(unit.per_m3 * place.detection_m3, 2), place.detection_m3),
        Cell(rounded(place.area_m2), place.area_m2),
        Cell(numbers(place.piles)),
        Cell(numbers(place.piles_before)),
    )


def _piles(piles: Sequence[Match], unit: Unit, words: Mapping[str, Any]) -> Table:
    header = (
        *(words["pile"], words["pile_was"], f"{words['before']} {unit.sign}"),
        *(f"{words['after']} {unit.sign}", f"{words['change_total']} {unit.sign}", words["state"]),
    )
    rows = (
        (
            Cell(numbers(one.after)),
            Cell(numbers(one.before)),
            Cell(rounded(unit.per_m3 * one.volume_before_m3, 4), one.volume_before_m3),
            Cell(rounded(unit.per_m3 * one.volume_after_m3, 4), one.volume_after_m3),
            Cell(unit.told(one.change), one.change.volume_m3),
            Cell(words["states"][one.state]),
        )
        for one in piles
    )
    return Table(header, tuple(rows))


def _not_counted(places: Sequence[Place], unit: Unit, words: Mapping[str, Any]) -> Table:
    volume = f"{words['volume']} {unit.sign}"
    header = (
        words["place"],
        words["reason"],
        volume,
        words["area"],
        f"{words['limit']} {unit.sign}",
    )
    rows = (
        (
            Cell(str(place.id), place.id),
            Cell(str(place.reason)),
            Cell(unit.told(place.net), place.net.volume_m3),
            Cell(rounded(place.area_m2), place.area_m2),
            Cell(rounded(unit.per_m3 * place.detection_m3, 2), place.detection_m3),
        )
        for place in places
    )
    return Table(header, tuple(rows))


def numbers(ids: tuple[int, ...]) -> str:
    """Return the numbers of piles, as text."""
    return ", ".join(map(str, ids)) or "-"


def _provenance(
    found: Comparison, date: str, words: Mapping[str, Any]
) -> tuple[tuple[str, str], ...]:
    u95 = COVERAGE * math.sqrt(float(found.alignment.covariance[0, 0]))
    return (
        *files_told(found.sources[0], words),
        *files_told(found.sources[1], words),
        (words["version"], _native.__version__),
        (words["seed"], str(found.settings.seed)),
        (words["measured_on"], date),
        (words["offset"], f"{with_uncertainty(found.alignment.offset_m, u95)} m"),
        *_shift(found, words),
    )


def _shift(found: Comparison, words: Mapping[str, Any]) -> list[tuple[str, str]]:
    if found.shift_m is None or found.fit.sideways is None:
        return []
    u95 = COVERAGE * found.fit.sideways.u_m
    both = "; ".join(with_uncertainty(value, u95) for value in found.shift_m[:2])
    return [(words["shift"], f"{both} m")]


def told(found: Comparison) -> str:
    """Return a comparison in a few lines of text."""
    unit = Unit.of(found)
    names = " and ".join(scan_name(source) for source in found.sources)
    what = f"{counted(len(found.places), 'place')}, {len(found.not_counted)} not counted"
    changes = ((name, getattr(found, name)) for name in ("gain", "loss", "net"))
    lines = (f"  {name}: {unit.told(one)} {unit.sign}" for name, one in changes if not one.is_none)
    return "\n".join([f"<Comparison of {names}: {what}>", *lines])
