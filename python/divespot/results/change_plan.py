"""The plan of a comparison: where and how much was gained and lost."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.numbers import with_uncertainty
from divespot.results.plan import (
    OTHER,
    PILE,
    blank_plan,
    draw_bar,
    draw_cells,
    draw_frame,
    finish_plan,
)
from divespot.results.plan_frame import PlanFrame
from divespot.results.plan_labels import Label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from divespot.results.comparison import Comparison, Place

#: Colours of loss, no change, gain; also distinguishable for the colour-blind.
COLORS = "PuOr_r"

#: If there are more places, labels are short.
_MOST_IN_FULL = 8


def draw_changes(
    found: Comparison, unit: str, per_m3: float, title: str = "", width_in: float = 8.0
) -> Figure:
    """Draw the differences of height, and the outlines of counted and uncounted places.

    In the later scan's own coordinates if they are plan coordinates of its ground. Differences
    below the detection limit of a cell are white.

    Raises
    ------
    DivespotError
        matplotlib is not installed.

    """
    frame = PlanFrame.of(found)
    figure, axes = blank_plan(frame, title, width_in)
    _draw_difference(axes, found, frame)
    draw_frame(axes, frame)
    finish_plan(axes, _draw_places(axes, found, frame, unit, per_m3))
    return figure


def difference_m(found: Comparison) -> NDArray[np.float64]:
    """Return the later height less the earlier one of each cell, NaN where either is missing."""
    return np.asarray(found.level.height_map.heights_m - found.level.base_m)


def _draw_difference(axes: Axes, found: Comparison, frame: PlanFrame) -> None:
    from matplotlib import colormaps  # noqa: PLC0415 - an extra
    from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - as above
    from matplotlib.colors import Normalize  # noqa: PLC0415 - as above

    off = difference_m(found)
    known = np.abs(off[~np.isnan(off)])
    detection = np.nan_to_num(found.alignment.detection_m)
    clear = known[known > detection]
    # A few outlying cells must not use up the whole colour range.
    most = float(np.quantile(clear, 0.99)) if len(clear) else max(float(detection), 1e-3)
    scale = ScalarMappable(Normalize(-most, most), COLORS)
    shown = np.where(np.abs(off) > detection, off, 0.0)
    image: Any = colormaps[COLORS](scale.norm(np.nan_to_num(shown)), bytes=True)
    image[..., 3] = np.where(np.isnan(off), 0, 255)
    draw_cells(axes, image, np.isnan(off), frame)
    draw_bar(axes, scale, "gain and loss of height in m")


def _draw_places(
    axes: Axes, found: Comparison, frame: PlanFrame, unit: str, per_m3: float
) -> list[Label]:
    in_full = len(found.places) <= _MOST_IN_FULL
    labels = []
    for place in found.places:
        line = _line(place, found, frame)
        axes.plot(*line.T, color=PILE, linewidth=1.6)
        told = with_uncertainty(per_m3 * place.net.volume_m3, per_m3 * place.net.u95_m3)
        sign = "+" if place.net.volume_m3 > 0.0 else ""
        text = f"{place.id}: {sign}{told if in_full else told.partition(' ')[0]} {unit}"
        x, y = (line.min(axis=0) + line.max(axis=0)) / 2.0
        labels.append(Label(text, float(x), float(y), PILE))
    for number, place in enumerate(found.not_counted):
        look: dict[str, Any] = {} if number else {"label": "not counted"}
        line = _line(place, found, frame)
        axes.plot(*line.T, color=OTHER, linewidth=0.9, linestyle=(0, (4, 2)), **look)
    return labels


def _line(place: Place, found: Comparison, frame: PlanFrame) -> NDArray[np.float64]:
    """Return the closed outline in the plan."""
    corners = np.array(place.outline_m).reshape(-1, 3)
    return frame.places(found.level.frame.to_level(np.concatenate([corners, corners[:1]])))
