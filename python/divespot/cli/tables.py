"""A report as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from divespot.numbers import rounded, volume_unit, with_uncertainty
from divespot.results.show_units import Shown
from divespot.results.telling import title

if TYPE_CHECKING:
    from collections.abc import Mapping

    from divespot.report import Pile, Report, Total


def report_table(report: Report, unit: str | None = None) -> Table:
    """Return a row for each pile, their total, and a row for each other object.

    The volume is the net of cut (above the base) and fill (below it).
    """
    items = (*report.piles, *report.other_objects)
    shown = Shown.of(report, unit)
    weighed = not shown.as_mass and any(item.mass_kg is not None for item in items)
    numbers = ("cut", "fill", "area\nm²", "height\nm", "seen")
    table = plain_table("", f"net {shown.header}", *numbers)
    table.padding = (0, 1, 0, 0)
    if weighed:
        table.add_column("mass kg", justify="right", no_wrap=True)
    table.add_column("remarks")
    for pile in report.piles:
        table.add_row(title(pile), *_cells(pile, shown, weighed=weighed))
    if len(report.piles) > 1:
        mass = [_mass(report.total)] if weighed else []
        cells = [shown.measured(report.total), *_sums(report, shown), "", "", ""]
        table.add_row("total", *cells, *mass, style="bold")
    table.add_section()
    for item in report.other_objects:
        table.add_row(f"other {item.id}", *_cells(item, shown, weighed=weighed), style="dim")
    return table


def _sums(report: Report, shown: Shown) -> tuple[str, str]:
    cut, fill = (sum(getattr(p, name) for p in report.piles) for name in ("cut_m3", "fill_m3"))
    return _parts(cut, fill, report.total.u95_m3, shown)


def _parts(cut_m3: float, fill_m3: float, u95_m3: float, shown: Shown) -> tuple[str, str]:
    """Return cut and fill with the digits that their uncertainty leaves."""
    return shown.number(cut_m3, u95_m3), shown.number(fill_m3, u95_m3)


def bases_table(report: Report) -> Table:
    """Return each pile's volume above every base that was compared."""
    unit, per_m3 = volume_unit(max(pile.volume_m3 for pile in report.piles))
    compared = [(title(pile), pile.volume_by_base_m3 or {}) for pile in report.piles]
    table = plain_table(f"volume {unit} by base", *compared[0][1])
    for name, volumes in compared:
        table.add_row(name, *(rounded(per_m3 * volume, 4) for volume in volumes.values()))
    return table


def times_table(timings_s: Mapping[str, float], points: int) -> Table:
    """Return a row for each stage, the sum and the points a second."""
    total_s = sum(timings_s.values())
    table = plain_table("stage", "ms", "share")
    for stage, seconds in timings_s.items():
        table.add_row(stage, f"{1e3 * seconds:.1f}", f"{seconds / total_s:.0%}")
    table.add_section()
    table.add_row("all stages", f"{1e3 * total_s:.1f}", "100%")
    table.add_row("points per second", f"{points / total_s:,.0f}", "")
    return table


def plain_table(first: str, *numbers: str) -> Table:
    """Return an empty table: a name at the left, then numbers."""
    table = Table(box=box.SIMPLE, show_edge=False, pad_edge=False, header_style="bold")
    table.add_column(first, no_wrap=True)
    for name in numbers:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _cells(item: Pile, shown: Shown, *, weighed: bool) -> list[str]:
    cells = [
        shown.measured(item),
        *_parts(item.cut_m3, item.fill_m3, item.u95_m3, shown),
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
    return with_uncertainty(item.mass_kg or 0.0, item.u95_mass_kg or 0.0)
