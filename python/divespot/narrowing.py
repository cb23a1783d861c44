"""What of a survey is read: the rectangle of a crop, or of outlines with what lies around them."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.boxes import box_of, grown, longer
from divespot.errors import DivespotError
from divespot.outline_features import read_features
from divespot.outline_place import Placing

if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping

    from numpy.typing import NDArray

    from divespot.io.wanted import Place, Plan, Rectangle
    from divespot.settings import Settings

#: On each side of outlines so much is read, as a share of the longer side of the box around them:
#: the ground that their bases follow from, and which tells what is level.
AROUND = 1.0

#: Bases that follow from the ground around a pile, or from nothing that is read.
NEAR = ("local", "height=", "camera-height=", "surface=")


def plan_of(settings: Settings) -> Plan | None:
    """Return what tells the rectangle that is read; None where all is needed."""
    if settings.crop is not None:
        x0, y0, _, x1, y1, _ = settings.crop
        return lambda _crs, _at: (x0, y0, x1, y1)
    if settings.compare_bases or not settings.base.startswith(NEAR):
        return None
    if settings.inside is not None:
        corners = np.array(settings.inside).reshape(2, 2)
        return lambda _crs, _at: _around(corners)
    if settings.outline is not None:
        return partial(_around_outlines, settings.outline)
    return None


def _around_outlines(
    outline: str | os.PathLike[str] | Mapping[str, Any], crs: str | None, at: Place
) -> Rectangle | None:
    """Return the rectangle around outlines in a scan's own system; None where that is not known.

    What is wrong with them is said where they are measured inside of.
    """
    try:
        found = read_features(outline)
        if found.system is not None and crs is None:
            return None
        placing = Placing.of(found.system, crs, np.array((*at, 0.0)), str)
        corners = [np.array(row) for item in found.items for row in _positions(item.geometry)]
        if not corners or any(len(row) != 2 or not np.isfinite(row).all() for row in corners):
            return None
        return _around(placing(np.array(corners)))
    except (DivespotError, OSError, TypeError, ValueError, OverflowError):
        return None


def _positions(geometry: Any) -> Iterator[list[float]]:  # noqa: ANN401 - any JSON value
    """Yield the positions of a geometry, however deep they lie."""
    parts = geometry.get("coordinates") if isinstance(geometry, dict) else geometry
    if not isinstance(parts, list) or not parts:
        return
    if isinstance(parts[0], list):
        for part in parts:
            yield from _positions(part)
    else:
        yield parts


def _around(corners: NDArray[np.float64]) -> Rectangle:
    box = box_of(corners)
    return grown(box, AROUND * longer(box))
