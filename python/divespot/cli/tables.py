"""A report as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.cli.table import Table
from divespot.numbers import rounded, volume_unit, with_uncertainty
from divespot.results.show_units import Shown
from divespot.results.telling import title

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from divespot.report import Pile, Report, Total


def report_table(report: Report, unit: str | None = None) -> Table:
    """Return a row for each pile, one for their total, and one for each other object.

    The volume is the net of cut (above the base) and fill (below it).
    """
    items = (*report.piles, *report.other_objects)
    shown = Shown.of(report, unit)
    weighed = not shown.as_mass and any(item.mass_kg is not None for item in items)
    mass = ["mass kg"] if weighed else []
    sizes = ("cut", "fill", "area\nm²", "height\nm", "seen", *mass)
    table = Table(("", f"net {shown.header}", *sizes, "remarks"), text=True, gap=2)
    for pile in report.piles:
        table.add_row(title(pile), *_cells(pile, shown, weighed=weighed))
    if len(report.piles) > 1:
        mass = [_mass(report.total)] if weighed else []
        parts = _parts(report.piles, report.total.u95_m3, shown)
        cells = [shown.measured(report.total), *parts, "", "", "", *mass, ""]
        table.add_row("total", *cells, style="bold")
    table.add_section()
    for item in report.other_objects:
        table.add_row(f"other {item.id}", *_cells(item, shown, weighed=weighed), style="dim")
    return table


def _parts(piles: Sequence[Pile], u95_m3: float, shown: Shown) -> tuple[str, str]:
    """Return cut and fill, rounded to the digits that their uncertainty justifies."""
    cut, fill = (
        sum(shown.per_m3_of(pile) * getattr(pile, name) for pile in piles)
        for name in ("cut_m3", "fill_m3")
    )
    u95 = u95_m3 * max(shown.per_m3_of(pile) for pile in piles)
    return shown.number(cut, u95), shown.number(fill, u95)


def bases_table(report: Report) -> Table:
    """Return each pile's volume above every base that was compared."""
    unit, per_m3 = volume_unit(max(pile.volume_m3 for pile in report.piles))
    compared = [(title(pile), pile.volume_by_base_m3 or {}) for pile in report.piles]
    table = Table((f"volume {unit} by base", *compared[0][1]))
    for name, volumes in compared:
        table.add_row(name, *(rounded(per_m3 * volume, 4) for volume in volumes.values()))
    return table


def times_table(timings_s: Mapping[str, float], points: int) -> Table:
    """Return a row for each stage, the sum, and the points per second."""
    total_s = sum(timings_s.values())
    table = Table(("stage", "ms", "share"))
    for stage, seconds in timings_s.items():
        table.add_row(stage, f"{1e3 * seconds:.1f}", f"{seconds / total_s:.0%}")
    table.add_section()
    table.add_row("all stages", f"{1e3 * total_s:.1f}", "100%")
    table.add_row("points per second", f"{points / total_s:,.0f}", "")
    return table


def _cells(item: Pile, shown: Shown, *, weighed: bool) -> list[str]:
    cells = [
        shown.measured(item),
        *_parts([item], item.u95_m3, shown),
        rounded(item.footprint_m2),
        rounded(item.max_height_m),
        f"{item.seen_fraction:.0%}",
    ]
    if weighed:
        cells.append(_mass(item))
    runs_out = "runs out of the scan" if item.touches_edge else None
    leans = "leans on a wall" if item.leans_on_wall else None
    return [*cells, ", ".join(filter(None, (item.reason, runs_out, leans)))]


def _mass(item: Pile | Total) -> str:
    return "-" if item.mass_kg is None else with_uncertainty(item.mass_kg, item.u95_mass_kg or 0.0)
