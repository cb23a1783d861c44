"""Saving the base of a scan, for later scans."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot._arguments import require_kind
from divespot.io.write import write
from divespot.output import other_ending, refuse_inputs
from divespot.report import Report

if TYPE_CHECKING:
    import os

#: Endings of formats that keep all digits of a base.
SAVED = (".ply", ".npy", ".xyz")


def save_base(report: Report, path: str | os.PathLike[str]) -> None:
    """Write the base that was used, for ``base="surface=..."`` of later scans.

    Parameters
    ----------
    report
        What `divespot.measure` returned.
    path
        ``.ply``, ``.npy`` or ``.xyz``: a point in the middle of each cell, in the scan's own
        frame and unit.

    Raises
    ------
    DivespotError
        The ending is unknown, or the file cannot be written.

    Examples
    --------
    >>> import divespot
    >>> from divespot import simulate
    >>> scan = simulate.scan("shape-05", density=0.03)
    >>> divespot.save_base(divespot.measure(scan.points), "floor.ply")
    >>> again = divespot.measure(scan.points, base="surface=floor.ply")
    >>> again.piles[0].base
    'surface'

    """
    require_kind("report", report, Report)
    if not str(path).lower().endswith(SAVED):
        raise other_ending(path, "a base", SAVED)
    refuse_inputs(path, "the base", report.inputs)
    level = report.level
    x, y = level.height_map.centers_m()
    places = np.stack([x, y, level.base_m], axis=-1)
    write(path, level.frame.to_scan(places[~np.isnan(level.base_m)]))
