"""Charts, drawn with matplotlib."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from divespot.plot import figure_class

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

COLORS = ("#00667a", "#c98b3c", "#a3324d", "#5b7f3a", "#6c5b9e", "#22303c", "#8a9aa8")


@dataclass(frozen=True)
class Line:
    """Points joined by a line; a dashed one is the paper's, or a fit."""

    label: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    dashed: bool = False


@dataclass(frozen=True)
class Chart:
    """Lines over numbers, or groups of bars over names.

    `band` is a half-width about 0 that is shaded.
    """

    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    names: tuple[str, ...] = ()
    log_x: bool = False
    log_y: bool = False
    band: float | None = None


def draw(chart: Chart, path: Path) -> None:
    """Draw a chart into a PNG file; the same chart gives the same bytes."""
    figure = figure_class()(figsize=(8.0, 4.2), layout="constrained")
    axes: Axes = figure.subplots()
    axes.spines[["top", "right"]].set_visible(False)
    if chart.band is not None:
        axes.axhspan(-chart.band, chart.band, color="#dfeee3", zorder=0)
        axes.axhline(0.0, color="#8a9aa8", linewidth=0.8)
    (_bars if chart.names else _lines)(axes, chart)
    axes.set(xlabel=chart.x_label, ylabel=chart.y_label)
    axes.legend(frameon=False, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, format="png", dpi=110, metadata={"Software": None})


def _lines(axes: Axes, chart: Chart) -> None:
    for line, color in zip(chart.lines, COLORS, strict=False):
        look: dict[str, Any] = {"linestyle": "--"} if line.dashed else {"marker": "o"}
        axes.plot(line.x, line.y, color=color, label=line.label, markersize=4, **look)
    if chart.log_x:
        axes.set_xscale("log")
    if chart.log_y:
        axes.set_yscale("log" if chart.band is None else "symlog")


def _bars(axes: Axes, chart: Chart) -> None:
    width = 0.8 / len(chart.lines)
    for i, (line, color) in enumerate(zip(chart.lines, COLORS, strict=False)):
        places = [x + (i - (len(chart.lines) - 1) / 2) * width for x in line.x]
        axes.bar(places, line.y, width, color=color, label=line.label)
    axes.set_xticks(range(len(chart.names)), chart.names)
    if chart.log_y:
        axes.set_yscale("log")
