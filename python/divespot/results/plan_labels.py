"""Placing labels without overlap."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.transforms import Bbox

#: Directions and distances, in label heights, tried in this order.
_DIRECTIONS = 12
_DISTANCES = (1.3, 2.2, 3.2, 4.5, 6.0)

#: Size of the letters, in points.
_SIZE = 8.5

#: Padding around a text, in font sizes.
_PAD = 0.5


@dataclass(frozen=True)
class Label:
    """A text at a position of the axes."""

    text: str
    x: float
    y: float
    color: str


def place_labels(axes: Axes, labels: list[Label], *, most: int = 60) -> None:
    """Write labels, each where it covers no earlier one, with a line to its position.

    At most `most` labels are written, in order; those that find no room are left out.
    """
    from matplotlib.text import Text  # noqa: PLC0415 - an extra
    from matplotlib.transforms import Bbox  # noqa: PLC0415 - as above

    figure: Any = axes.figure
    renderer = figure.canvas.get_renderer()
    room = axes.get_window_extent(renderer)
    taken: list[Bbox] = []
    points_a_pixel = 72.0 / figure.dpi
    for label in labels[:most]:
        written = axes.annotate(
            label.text,
            (label.x, label.y),
            xytext=(0, 0),
            textcoords="offset points",
            ha="center",
            va="center",
            color="white",
            fontsize=_SIZE,
            zorder=5,
            bbox={"boxstyle": "round,pad=0.25", "facecolor": label.color, "edgecolor": "white"},
            arrowprops={"arrowstyle": "-", "color": label.color, "linewidth": 1.0, "shrinkB": 0},
        )
        size = Text.get_window_extent(written, renderer).padded(_PAD * _SIZE)
        x, y = axes.transData.transform((label.x, label.y)) - (size.width / 2, size.height / 2)
        box = Bbox.from_bounds(x, y, size.width, size.height)
        found = next(
            (at for at in _offsets(box.height) if _fits(box.translated(*at), room, taken)), None
        )
        if found is None:
            written.remove()
            continue
        taken.append(box.translated(*found))
        dx, dy = found
        written.set_position((dx * points_a_pixel, dy * points_a_pixel))


def _fits(box: Bbox, room: Bbox, taken: list[Bbox]) -> bool:
    inside = all(room.contains(x, y) for x, y in ((box.x0, box.y0), (box.x1, box.y1)))
    return inside and not any(box.overlaps(other) for other in taken)


def _offsets(height: float) -> Iterator[tuple[float, float]]:
    yield 0.0, 0.0
    for distance in _DISTANCES:
        for i in range(_DIRECTIONS):
            angle = math.pi / 2 + 2 * math.pi * i / _DIRECTIONS
            yield 1.6 * distance * height * math.cos(angle), distance * height * math.sin(angle)
