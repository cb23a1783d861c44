"""What the tests ask of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from divespot import Pile, Report


def objects(report: Report) -> tuple[Pile, ...]:
    """Return all that stands on the ground."""
    return report.piles + report.other_objects


def volume_m3(report: Report) -> float:
    """Return the volume of the only object."""
    (only,) = objects(report)
    return only.volume_m3


def result(report: Report) -> dict[str, Any]:
    """Return what must be the same bits: all but the times and the number of threads."""
    found = report.to_dict()
    del found["timings_s"], found["settings"]["threads"]
    return found
