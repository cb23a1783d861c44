"""A report in a few lines of text."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

from divespot.errors import printable, shortened
from divespot.results.show_units import Shown

if TYPE_CHECKING:
    from divespot.intake import Source
    from divespot.report import Pile, Report

#: Most piles that are listed.
MOST = 10


def told(report: Report) -> str:
    """Return the scan, its piles, their total, and the number of other objects and warnings."""
    shown = Shown.of(report)
    piles = [f"  {title(pile)}: {shown.measured(pile)} {shown.unit}" for pile in report.piles]
    rest = [f"  and {len(piles) - MOST} more"] if len(piles) > MOST else []
    total = [f"  total: {shown.measured(report.total)} {shown.unit}"] if len(piles) > 1 else []
    return "\n".join([f"<Report of {_what(report)}>", *piles[:MOST], *rest, *total])


def title(pile: Pile) -> str:
    """Return the title of a pile."""
    return f"pile {pile.id}" + (f" ({shortened(printable(pile.name), 40)})" if pile.name else "")


def scan_name(source: Source) -> str:
    """Return the name of a scan's file without its folder."""
    return "an array" if source.path is None else printable(PurePath(source.path).name)


def _what(report: Report) -> str:
    parts = [f"{scan_name(report.source)}: {report.source.points:,} points"]
    parts.append(counted(len(report.piles), "pile"))
    if report.other_objects:
        parts.append(counted(len(report.other_objects), "other object"))
    if report.warnings:
        parts.append(counted(len(report.warnings), "warning"))
    return ", ".join(parts)


def counted(number: int, thing: str) -> str:
    """Return a number of things: 1 pile, 3 piles."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
