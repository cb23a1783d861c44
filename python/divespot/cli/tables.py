"""A report as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.cli.table import Table
from divespot.errors import printable, shortened
from divespot.numbers import rounded, volume_unit, with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Mapping

    from divespot.report import Pile, Report, Total


def report_table(report: Report) -> Table:
    """Return a row for each pile, their total, and a row for each other object."""
    items = (*report.piles, *report.other_objects)
    unit, per_m3 = volume_unit(max((abs(item.volume_m3) for item in items), default=1.0))
    weighed = any(item.mass_kg is not None for item in items)
    mass = ["mass kg"] if weighed else []
    numbers = (f"volume {unit}", "footprint\nm²", "height\nm", "seen", *mass)
    table = Table(("", *numbers, "remarks"), text=True)
    for pile in report.piles:
        table.add_row(_title(pile), *_cells(pile, per_m3, weighed=weighed))
    if len(report.piles) > 1:
        mass = [_mass(report.total)] if weighed else []
        cells = (_volume(report.total, per_m3), "", "", "", *mass, "")
        table.add_row("total", *cells, style="bold")
    table.add_section()
    for item in report.other_objects:
        table.add_row(f"other {item.id}", *_cells(item, per_m3, weighed=weighed), style="dim")
    return table


def bases_table(report: Report) -> Table:
    """Return each pile's volume above every base that was compared."""
    unit, per_m3 = volume_unit(max(pile.volume_m3 for pile in report.piles))
    compared = [(_title(pile), pile.volume_by_base_m3 or {}) for pile in report.piles]
    table = Table((f"volume {unit} by base", *compared[0][1]))
    for title, volumes in compared:
        table.add_row(title, *(rounded(per_m3 * volume, 4) for volume in volumes.values()))
    return table


def times_table(timings_s: Mapping[str, float], points: int) -> Table:
    """Return a row for each stage, the sum and the points a second."""
    total_s = sum(timings_s.values())
    table = Table(("stage", "ms", "share"))
    for stage, seconds in timings_s.items():
        table.add_row(stage, f"{1e3 * seconds:.1f}", f"{seconds / total_s:.0%}")
    table.add_section()
    table.add_row("all stages", f"{1e3 * total_s:.1f}", "100%")
    table.add_row("points per second", f"{points / total_s:,.0f}", "")
    return table


def _cells(item: Pile, per_m3: float, *, weighed: bool) -> list[str]:
    cells = [
        _volume(item, per_m3),
        rounded(item.footprint_m2),
        rounded(item.max_height_m),
        f"{item.seen_fraction:.0%}",
    ]
    if weighed:
        cells.append(_mass(item))
    runs_out = "runs out of the scan" if item.touches_edge else None
    leans = "leans on a wall" if item.leans_on_wall else None
    return [*cells, ", ".join(filter(None, (item.reason, runs_out, leans)))]


def _title(pile: Pile) -> str:
    return f"pile {pile.id}" + (f" ({shortened(printable(pile.name), 40)})" if pile.name else "")


def _mass(item: Pile | Total) -> str:
    return with_uncertainty(item.mass_kg or 0.0, item.u95_mass_kg or 0.0)


def _volume(item: Pile | Total, per_m3: float) -> str:
    return with_uncertainty(per_m3 * item.volume_m3, per_m3 * item.u95_m3)
