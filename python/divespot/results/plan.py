"""The plan of a scan: heights, outlines, and each pile's volume."""

from __future__ import annotations

import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.extras import extra
from divespot.numbers import rounded
from divespot.results.drawn_fill import filled
from divespot.results.plan_frame import PlanFrame
from divespot.results.plan_labels import Label, place_labels
from divespot.results.show_units import Shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from divespot.report import Report

INK, PILE, OTHER = "#22303c", "#00667a", "#6c7a89"
HATCH, PAPER = "#b7c0c7", "#fefefe"

#: Vertical exaggeration for the shading only, and the direction of its light.
_LIGHT_DEG, _LIGHT_ALTITUDE_DEG, _EXAGGERATION = 315.0, 50.0, 1.5

#: Inches taken by the colour bar and the y axis, and by the title and the x axis.
_BESIDE_IN, _BELOW_IN, _TALLEST = 1.7, 0.9, 0.9

#: If there are more piles, labels are short.
_MOST_IN_FULL = 8

#: If there are more other objects, they are not labelled.
_MOST_REASONS = 5


def draw_plan(report: Report, title: str = "", width_in: float = 8.0) -> Figure:
    """Draw the plan, in the scan's own coordinates if they are plan coordinates of its ground.

    Heights are above the ground, hatched where not seen. The figure is not known to pyplot.

    Raises
    ------
    DivespotError
        matplotlib is not installed, or the report is from JSON.

    """
    frame = PlanFrame.of(report)
    figure, axes = blank_plan(frame, title, width_in)
    _draw_heights(axes, report, frame)
    draw_frame(axes, frame)
    finish_plan(axes, _draw_outlines(axes, report, frame))
    return figure


def blank_plan(frame: PlanFrame, title: str, width_in: float) -> tuple[Figure, Axes]:
    """Return a figure with axes that contain the whole map."""
    need = "a picture needs matplotlib"
    low, high = frame.corners().min(axis=0), frame.corners().max(axis=0)
    figure: Figure = extra("matplotlib.figure", "plot", need).Figure(
        figsize=_size_in(float((high - low)[1] / (high - low)[0]), width_in), layout="constrained"
    )
    extra("matplotlib.backends.backend_agg", "plot", need).FigureCanvasAgg(figure)
    axes = figure.subplots()
    margin = 0.02 * (high - low).max()
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    axes.set_aspect("equal")
    axes.set_title(title, color=INK, fontsize=12, loc="left")
    return figure, axes


def finish_plan(axes: Axes, labels: list[Label]) -> None:
    """Add the legend, and the labels where there is room."""
    if axes.get_legend_handles_labels()[0]:
        box = axes.legend(loc="lower right", fontsize=8, labelcolor=INK, framealpha=0.8)
        box.get_frame().set(facecolor=PAPER, linewidth=0)
    figure: Any = axes.figure
    figure.draw_without_rendering()  # computes the positions of what labels must not cover
    figure.set_layout_engine("none")
    place_labels(axes, labels)


def _size_in(ratio: float, width_in: float) -> tuple[float, float]:
    """Return the size of a figure whose map is `ratio` times as high as wide."""
    map_in = width_in - _BESIDE_IN
    height_in = min(map_in * ratio, _TALLEST * width_in)
    return max(height_in / ratio, 0.4 * map_in) + _BESIDE_IN, max(height_in, 2.0) + _BELOW_IN


def above_ground_m(report: Report) -> NDArray[np.float64]:
    """Return the heights of the cells above the ground, NaN for unseen cells."""
    return np.asarray(report.level.height_map.heights_m - report.level.ground_m)


def top_m(report: Report) -> float:
    """Return the height at which the colour scale ends: that of the highest pile."""
    if report.piles:
        return max(pile.max_height_m for pile in report.piles)
    heights = above_ground_m(report)
    seen = heights[~np.isnan(heights)]
    return max(float(seen.max(initial=0.0)), report.level.height_map.cell_m)


def _draw_heights(axes: Axes, report: Report, frame: PlanFrame) -> None:
    from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - an extra
    from matplotlib.colors import Normalize  # noqa: PLC0415 - as above

    heights = above_ground_m(report)
    norm = Normalize(0.0, top_m(report))
    image = _shaded(heights, report.level.height_map.cell_m, norm)
    draw_cells(axes, image, np.isnan(heights), frame)
    draw_bar(axes, ScalarMappable(norm, "YlOrBr"), "height above the ground in m")


def draw_cells(
    axes: Axes, image: NDArray[np.uint8], unseen: NDArray[np.bool_], frame: PlanFrame
) -> None:
    """Draw an image of the cells, with hatching for those that were not seen."""
    from matplotlib.patches import Polygon  # noqa: PLC0415 - an extra
    from matplotlib.transforms import Affine2D  # noqa: PLC0415 - as above

    rows, columns = unseen.shape
    if unseen.any():
        hatched = Polygon(
            frame.corners(), facecolor="none", edgecolor=HATCH, hatch="////", linewidth=0, zorder=0
        )
        hatched.set_label("not seen")
        axes.add_patch(hatched)
    (a, c, e), (b, d, f) = frame.matrix
    axes.imshow(
        image,
        origin="lower",
        extent=(0, columns, 0, rows),
        interpolation="nearest",
        zorder=1,
        transform=Affine2D.from_values(a, b, c, d, e, f) + axes.transData,
        aspect=axes.get_aspect(),
    )


def draw_bar(axes: Axes, scale: Any, label: str) -> None:  # noqa: ANN401 - matplotlib's
    """Draw the colour bar."""
    bar = axes.figure.colorbar(scale, ax=axes, location="right", shrink=0.7, aspect=30, pad=0.02)
    bar.ax.tick_params(colors=INK, labelsize=8)
    bar.set_label(label, color=INK)
    bar.outline.set_visible(False)


def _shaded(heights_m: NDArray[np.float64], cell_m: float, norm: Any) -> NDArray[np.uint8]:  # noqa: ANN401
    """Return colours by height, lit from the upper left; transparent for unseen cells."""
    from matplotlib import colormaps  # noqa: PLC0415 - an extra
    from matplotlib.colors import LightSource  # noqa: PLC0415 - as above

    whole = filled(heights_m)
    light = LightSource(_LIGHT_DEG, _LIGHT_ALTITUDE_DEG)
    colors = colormaps["YlOrBr"](norm(np.nan_to_num(whole)))
    spread = {"dx": cell_m, "dy": cell_m, "vert_exag": _EXAGGERATION}
    # Row 0 is the southernmost, so the light is mirrored too.
    shaded = light.shade_rgb(
        colors[::-1, :, :3], np.nan_to_num(whole)[::-1], blend_mode="soft", **spread
    )
    alpha = np.where(np.isnan(heights_m), 0.0, 1.0)
    return np.asarray(255.0 * np.dstack([shaded[::-1], alpha]), dtype=np.uint8)


def draw_frame(axes: Axes, frame: PlanFrame) -> None:
    """Draw coordinates, scale bar and north arrow."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - an extra

    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5, min_n_ticks=2))
    axes.ticklabel_format(useOffset=False, style="plain")
    axes.tick_params(colors=INK, labelsize=8)
    axes.spines[:].set_color(HATCH)
    axes.set_xlabel(f"x in {frame.unit}", color=INK)
    axes.set_ylabel(f"y in {frame.unit}", color=INK)
    width = float(np.ptp(axes.get_xlim())) * frame.metres
    length_m = _round_length(width / 4.0)
    artists = import_module("mpl_toolkits.axes_grid1.anchored_artists")  # ships no types
    bar = artists.AnchoredSizeBar(
        axes.transData,
        length_m / frame.metres,
        f"{rounded(length_m, 1)} m",
        "lower left",
        pad=0.4,
        color=INK,
        frameon=True,
        size_vertical=0.006 * width / frame.metres,
    )
    bar.patch.set(facecolor=PAPER, alpha=0.8, edgecolor="none")
    axes.add_artist(bar)
    axes.annotate(
        frame.up_arrow,
        (0.975, 0.97),
        xytext=(0.975, 0.86),
        xycoords="axes fraction",
        ha="center",
        va="center",
        color=INK,
        fontsize=11,
        fontweight="bold",
        zorder=6,
        arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.6},
        bbox={
            "boxstyle": "circle,pad=0.1",
            "facecolor": PAPER,
            "alpha": 0.8,
            "edgecolor": "none",
        },
    )


def _round_length(length_m: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten up to a length."""
    power = 10.0 ** math.floor(math.log10(length_m))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length_m)


def _draw_outlines(axes: Axes, report: Report, frame: PlanFrame) -> list[Label]:
    """Draw the outlines of piles and other objects; return their labels, piles first."""
    shown = Shown.of(report)
    # With many piles, only the table gives the uncertainty.
    told = shown.measured if len(report.piles) <= _MOST_IN_FULL else shown.rounded
    piles = iter(report.piles)
    labels: list[Label] = []
    others: list[Label] = []
    for outline in report.level.outlines:
        pile = next(piles, None) if outline.reason is None else None
        if not outline.corners_m:  # too small for an outline
            continue
        line = frame.places(np.array([*outline.corners_m, outline.corners_m[0]]))
        x, y = (line.min(axis=0) + line.max(axis=0)) / 2.0
        if pile is None:
            look: dict[str, Any] = {"label": "not counted"} if not others else {}
            axes.plot(*line.T, color=OTHER, linewidth=1.1, linestyle=(0, (4, 2)), **look)
            others.append(Label(str(outline.reason), float(x), float(y), OTHER))
        else:
            axes.plot(*line.T, color=PILE, linewidth=1.8)
            text = f"{pile.id}: {told(pile)} {shown.unit}"
            labels.append(Label(text, float(x), float(y), PILE))
    return [*labels, *others[:_MOST_REASONS]]
