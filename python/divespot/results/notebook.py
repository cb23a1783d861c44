"""A report in a notebook: a table, and the picture if matplotlib is installed."""

from __future__ import annotations

from base64 import b64encode
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING

from divespot.errors import DivespotError
from divespot.numbers import rounded
from divespot.plot import figure
from divespot.results.show_units import Shown
from divespot.results.telling import scan_name, title

if TYPE_CHECKING:
    from divespot.report import Pile, Report, Total


def html(report: Report) -> str:
    """Return the report as an HTML fragment."""
    shown = Shown.of(report)
    rows = [_row(title(pile), pile, shown) for pile in report.piles]
    if len(rows) > 1:
        rows.append(_cells("total", shown.measured(report.total), _mass(report.total), "", "", ""))
    rows += [_row(f"other {item.id}: {item.reason}", item, shown) for item in report.other_objects]
    names = ("", shown.header, "mass kg", "area m²", "height m", "seen")
    header = "".join(f"<th>{escape(name)}</th>" for name in names)
    points = f"{escape(scan_name(report.source))}: {report.source.points:,} points"
    told = "".join(f"<li>{escape(warning)}</li>" for warning in report.warnings)
    return (
        f"<div>{_picture(report)}<table><caption>{points}</caption><tr>{header}</tr>"
        f"{''.join(rows)}</table><ul>{told}</ul></div>"
    )


def _row(name: str, item: Pile, shown: Shown) -> str:
    sizes = rounded(item.footprint_m2), rounded(item.max_height_m), f"{item.seen_fraction:.0%}"
    return _cells(name, shown.measured(item), _mass(item), *sizes)


def _cells(*texts: str) -> str:
    return f"<tr>{''.join(f'<td>{escape(text)}</td>' for text in texts)}</tr>"


def _mass(item: Pile | Total) -> str:
    return "" if item.mass_kg is None else rounded(item.mass_kg, 4)


def _picture(report: Report) -> str:
    """Return the picture; an empty text if it cannot be drawn."""
    try:
        drawn = figure(report)
    except DivespotError:
        return ""
    png = BytesIO()
    drawn.savefig(png, format="png", dpi=100)
    data = b64encode(png.getvalue()).decode()
    return f'<img alt="plan" style="max-width:100%" src="data:image/png;base64,{data}">'
