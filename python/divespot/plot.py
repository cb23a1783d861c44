"""Pictures of a report: the plan, and the height histogram with the ground."""

from __future__ import annotations

import math
from io import BytesIO
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import number, require_kind
from divespot.errors import DivespotError, shortened
from divespot.extras import extra
from divespot.numbers import rounded
from divespot.output import other_ending, refuse_inputs, whole
from divespot.report import Report
from divespot.results.plan import INK, PILE, above_ground_m, draw_plan, top_m
from divespot.results.show_units import Shown
from divespot.results.telling import counted
from divespot.settings import given

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure

AREA = "#c98b3c"

#: For each ending of a picture: its format, and the metadata field that names divespot.
FORMATS = {".png": "Software", ".svg": "Creator", ".pdf": "Creator"}

DPI = 200


def figure(report: Report, *, truth_m3: float | None = None) -> Figure:
    """Draw the plan of a report.

    Parameters
    ----------
    report
        What `divespot.measure` returned.
    truth_m3
        The true volume of all piles, if known, for the title.

    Returns
    -------
    figure
        Heights above the ground, hatched where not seen, the outlines of piles with their
        volumes, and those of other objects; in the scan's coordinates if its x and y are plan
        coordinates. The figure is not registered with pyplot: no window opens.

    Raises
    ------
    DivespotError
        matplotlib is not installed, or the report is from JSON.

    """
    require_kind("report", report, Report)
    if truth_m3 is not None and not math.isfinite(number("truth_m3", truth_m3)):
        raise DivespotError(f"truth_m3 is {truth_m3}: a finite number is needed")
    return draw_plan(report, shortened(_title(report, truth_m3), 70))


def ground_figure(report: Report) -> Figure:
    """Draw the area at each height, the ground, and the margin above which objects begin.

    Raises
    ------
    DivespotError
        matplotlib is not installed, or the report is from JSON.

    """
    require_kind("report", report, Report)
    drawn: Figure = figure_class()(figsize=(5.0, 5.0), layout="constrained")
    axes = drawn.subplots()
    axes.spines[["top", "right"]].set_visible(False)
    heights = above_ground_m(report)
    top, settings = top_m(report), report.settings
    edges = np.arange(-0.15 * top, 1.15 * top, max(given(settings.stages.bin_m), top / 200.0))
    cells, _ = np.histogram(heights[~np.isnan(heights)], edges)
    area_m2 = cells * report.level.height_map.cell_m**2
    axes.stairs(area_m2, edges, orientation="horizontal", fill=True, color=AREA)
    axes.set_xscale("log")
    axes.axhline(0.0, color=INK, linewidth=1.6, label="ground")
    margin = given(settings.margin_m)
    axes.axhline(margin, color=PILE, linewidth=1.4, linestyle="--", label="objects from here up")
    axes.set(xlabel="area per bin in m²", ylabel="height above the ground in m")
    axes.legend(loc="upper right", frameon=False, fontsize=8)
    return drawn


def save_picture(
    report: Report, path: str | os.PathLike[str], *, truth_m3: float | None = None
) -> None:
    """Draw the plan into a PNG, SVG or PDF file (see `figure`).

    Raises
    ------
    DivespotError
        The ending is unknown, matplotlib is not installed, or the file cannot be written.

    Examples
    --------
    >>> import divespot
    >>> from divespot import plot, simulate
    >>> report = divespot.measure(simulate.scan("shape-05", density=0.03).points)
    >>> plot.save_picture(report, "piles.png")

    """
    require_kind("report", report, Report)
    with _checked(report, path) as stream:
        stream.write(drawn_bytes(figure(report, truth_m3=truth_m3), path))


def save_ground_picture(report: Report, path: str | os.PathLike[str]) -> None:
    """Draw the height histogram into a PNG, SVG or PDF file (see `ground_figure`).

    Raises
    ------
    DivespotError
        As for `save_picture`.

    """
    require_kind("report", report, Report)
    with _checked(report, path) as stream:
        stream.write(drawn_bytes(ground_figure(report), path))


def _checked(report: Report, path: str | os.PathLike[str]) -> Any:  # noqa: ANN401 - a context
    refuse_inputs(path, "the picture", report.inputs)
    return whole(path)


def drawn_bytes(drawn: Figure, path: str | os.PathLike[str]) -> bytes:
    """Return a figure in the format of the path's ending."""
    ending = PurePath(path).suffix.lower()
    if ending not in FORMATS:
        raise other_ending(path, "a picture", FORMATS)
    data = BytesIO()
    about = {FORMATS[ending]: "divespot"}
    drawn.savefig(data, format=ending[1:], dpi=DPI, metadata=about)
    return data.getvalue() + (b"% written by divespot\n" if ending == ".pdf" else b"")


def figure_class() -> Any:  # noqa: ANN401 - matplotlib may be absent
    """Return matplotlib's `Figure`.

    Raises
    ------
    DivespotError
        matplotlib is not installed.

    """
    return extra("matplotlib.figure", "plot", "a picture needs matplotlib").Figure


def _title(report: Report, truth_m3: float | None) -> str:
    if not report.piles:
        return "no pile found"
    shown = Shown.of(report)
    truth = (
        "" if truth_m3 is None else f"   (truth {rounded(truth_m3 * shown.per_m3, 5)} {shown.unit})"
    )
    found = counted(len(report.piles), "pile")
    return f"{found}: {shown.measured(report.total)} {shown.unit}{truth}"
