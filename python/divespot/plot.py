"""The picture of a report: height map with outlines, and height histogram."""

from __future__ import annotations

import itertools
import math
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import number, require_kind
from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.numbers import rounded, with_uncertainty
from divespot.output import refuse_inputs, whole
from divespot.report import Report
from divespot.settings import given

if TYPE_CHECKING:
    import os

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray


INK, PILE, OTHER = "#22303c", "#00667a", "#6c7a89"
AREA, UNSEEN = "#c98b3c", "#e4e8eb"


def figure(report: Report, *, truth_m3: float | None = None) -> Figure:
    """Draw a report.

    Parameters
    ----------
    report
        What `divespot.measure` returned.
    truth_m3
        The true volume of all piles, where it is known, for the title.

    Returns
    -------
    figure
        The height map in metres above the ground with the outlines of piles (numbered) and of
        other objects, and beside it the height histogram. Not known to pyplot: no window opens.

    Raises
    ------
    DivespotError
        matplotlib is not installed.

    """
    require_kind("report", report, Report)
    if truth_m3 is not None and not math.isfinite(number("truth_m3", truth_m3)):
        raise DivespotError(f"truth_m3 is {truth_m3}: a finite number is needed")
    rows, columns = report.level.height_map.heights_m.shape
    # As high as the map at its width needs, within reason.
    height_in = min(max(7.0 * rows / columns + 1.6, 3.6), 8.0)
    drawn: Figure = figure_class()(figsize=(10.0, height_in), layout="constrained")
    scene, histogram = drawn.subplots(1, 2, width_ratios=(2.6, 1))
    histogram.spines[["top", "right"]].set_visible(False)
    drawn.suptitle(_title(report, truth_m3), color=INK, fontsize=13)
    _draw_map(scene, report)
    _draw_histogram(histogram, report)
    return drawn


def save_picture(
    report: Report, path: str | os.PathLike[str], *, truth_m3: float | None = None
) -> None:
    """Draw a report into a PNG file (see `figure`).

    Raises
    ------
    DivespotError
        matplotlib is not installed, or the file cannot be written.

    Examples
    --------
    >>> import divespot
    >>> from divespot import plot, simulate
    >>> report = divespot.measure(simulate.scan("shape-05", density=0.03).points)
    >>> plot.save_picture(report, "piles.png")

    """
    require_kind("report", report, Report)
    refuse_inputs(path, "the picture", report.inputs)
    with whole(path) as stream:
        png = BytesIO()
        drawn = figure(report, truth_m3=truth_m3)
        drawn.savefig(png, format="png", dpi=100, metadata={"Software": "divespot"})
        stream.write(png.getvalue())


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
    found = "1 pile" if len(report.piles) == 1 else f"{len(report.piles)} piles"
    measured = with_uncertainty(report.total.volume_m3, report.total.u95_m3)
    truth = "" if truth_m3 is None else f"   (truth {rounded(truth_m3, 5)} m³)"
    return f"{found}: {measured} m³{truth}"


def _draw_map(axes: Axes, report: Report) -> None:
    rows, columns = report.level.height_map.heights_m.shape
    cell = report.level.height_map.cell_m
    image = axes.imshow(
        _above_ground_m(report),
        origin="lower",
        extent=(0.0, columns * cell, 0.0, rows * cell),
        cmap="YlOrBr",
        vmin=0.0,
        vmax=_top_m(report),
        interpolation="nearest",
    )
    axes.set_facecolor(UNSEEN)
    _draw_outlines(axes, report)
    axes.set(xlabel="x in m", ylabel="y in m")
    bar = axes.figure.colorbar(
        image, ax=axes, location="bottom", extend="both", fraction=0.06, aspect=40
    )
    bar.set_label("height above the ground in m")


def _draw_outlines(axes: Axes, report: Report) -> None:
    numbers = itertools.count(1)
    for outline in report.level.outlines:
        text = outline.reason or f"pile {next(numbers)}"
        if not outline.corners_m:  # too small to have one
            continue
        corners = np.array([*outline.corners_m, outline.corners_m[0]])[:, :2]
        corners -= report.level.height_map.origin_m
        color = PILE if outline.reason is None else OTHER
        axes.plot(corners[:, 0], corners[:, 1], color=color, linewidth=1.8)
        axes.annotate(
            text,
            (float(np.ptp(corners[:, 0]) / 2 + corners[:, 0].min()), float(corners[:, 1].max())),
            xytext=(0, 4),
            textcoords="offset points",
            ha="center",
            color="white",
            fontsize=8,
            bbox={"boxstyle": "round,pad=0.2", "facecolor": color, "edgecolor": "none"},
        )


def _draw_histogram(axes: Axes, report: Report) -> None:
    """Draw the area at each height, the ground and the margin above which objects begin."""
    heights = _above_ground_m(report)
    top, settings = _top_m(report), report.settings
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


def _above_ground_m(report: Report) -> NDArray[np.float64]:
    return np.asarray(report.level.height_map.heights_m - report.level.ground_m)


def _top_m(report: Report) -> float:
    """Return the height up to which colours differ: that of the highest pile."""
    if report.piles:
        return max(pile.max_height_m for pile in report.piles)
    heights = _above_ground_m(report)
    seen = heights[~np.isnan(heights)]
    return max(float(seen.max(initial=0.0)), report.level.height_map.cell_m)
