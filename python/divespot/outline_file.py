"""Outlines: areas to measure inside."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from divespot import _native
from divespot.dot import twice_area
from divespot.errors import DivespotError, shortened, unreadable
from divespot.outline_checks import first_overlap
from divespot.outline_features import read_features
from divespot.outline_place import Placing

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from divespot.frame import Frame
    from divespot.outline_features import Feature
    from divespot.settings import Settings

#: The path of a file, or GeoJSON as a dict.
Outlines: TypeAlias = str | os.PathLike[str] | Mapping[str, Any]

#: Largest angle between the ground's normal and the scan's z at which x and y are plan coordinates.
PLAN_DEG = 45.0


@dataclass(frozen=True, eq=False)
class Region:
    """An area to measure inside.

    Attributes
    ----------
    name
        Its name in the file; None if it has none.
    rings
        Lines of shape ``(n, 2)`` in the level frame, not closed: outer lines counter-clockwise,
        holes clockwise; the largest line first.
    material
        Its material, if the file names one.

    """

    name: str | None
    rings: tuple[NDArray[np.float64], ...]
    material: str | None = None


def find_regions(
    settings: Settings, frame: Frame, crs: str | None, warn: Callable[[str], None]
) -> list[Region]:
    """Return the areas to measure inside: those of a file, or a rectangle.

    Raises
    ------
    DivespotError
        The file cannot be read, or the rectangle has no area.

    """
    if settings.outline is not None:
        return read_regions(settings.outline, frame, crs, warn)
    x0, y0, x1, y1 = settings.inside or (0.0,) * 4
    line = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    try:
        ring = _ring(line, Placing(frame.origin_m / frame.metres), frame)
    except DivespotError as error:
        raise DivespotError(f"the rectangle inside {error}") from None
    return [Region(None, (_turned(ring, hole=False),))]


def read_regions(
    outline: Outlines,
    frame: Frame,
    crs: str | None = None,
    warn: Callable[[str], None] = lambda _: None,
) -> list[Region]:
    """Read Polygons and MultiPolygons, one region per feature, from a file or GeoJSON as a dict.

    x and y are in the scan's frame and unit, or in another reference system if the scan states its
    own, `crs`. A third coordinate is used only if the scan's x and y are not plan coordinates of
    its ground; then it is needed.

    Raises
    ------
    DivespotError
        The file cannot be read, holds no polygon or other geometries, or a line is not closed,
        crosses itself or has no area.

    """
    path = name_of(outline)
    told: dict[str, None] = {}
    try:
        found = read_features(outline)
        if found.passed_over:
            warn(f"{path}: {found.passed_over} features that are no areas were ignored")
        scan_at = frame.origin_m / frame.metres
        placing = Placing.of(found.system, crs, scan_at, told.setdefault)
        regions = [
            _region(number, feature, placing, frame)
            for number, feature in enumerate(found.items, 1)
        ]
        _refuse_overlap(regions)
    except OSError as error:
        raise unreadable(path, error) from None
    except DivespotError as error:
        raise DivespotError(f"{path}: {error}") from None
    for sentence in told:
        warn(sentence)
    return regions


def name_of(outline: Outlines) -> str:
    """Return the name of outlines in errors: the path, if there is one."""
    return "outline" if isinstance(outline, Mapping) else os.fspath(outline)


def _refuse_overlap(regions: list[Region]) -> None:
    found = first_overlap([region.rings for region in regions])
    if found is not None:
        one, other = (_what(i + 1, regions[i].name) for i in found)
        raise DivespotError(f"{one} and {other} overlap: outlines without overlap are needed")


def _region(number: int, feature: Feature, placing: Placing, frame: Frame) -> Region:
    geometry = feature.geometry
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    what = _what(number, feature.name)
    if kind not in ("Polygon", "MultiPolygon"):
        raise DivespotError(f"{what} is {kind or 'no geometry'}: Polygon or MultiPolygon is needed")
    coordinates = geometry.get("coordinates")
    polygons = [coordinates] if kind == "Polygon" else coordinates
    if not isinstance(polygons, list) or not polygons or not all(map(_is_filled, polygons)):
        raise DivespotError(f"{what} has no lines: coordinates of a {kind} are needed")
    try:
        parts = [[_ring(line, placing, frame) for line in polygon] for polygon in polygons]
    except DivespotError as error:
        raise DivespotError(f"{what} {error}") from None
    rings = [_turned(ring, hole=i > 0) for part in parts for i, ring in enumerate(part)]
    return Region(feature.name, tuple(sorted(rings, key=_area, reverse=True)), feature.material)


def _what(number: int, name: str | None) -> str:
    return f"outline {number}" + (f" ({shortened(name, 60)})" if name else "")


def _is_filled(polygon: Any) -> bool:  # noqa: ANN401
    return isinstance(polygon, list) and len(polygon) > 0


def _ring(line: Any, placing: Placing, frame: Frame) -> NDArray[np.float64]:  # noqa: ANN401
    """Return a closed line's corners in the level frame, the last one not repeated."""
    corners = _positions(line)
    if len(corners) < 4 or (corners[0] != corners[-1]).any():
        raise DivespotError("is not closed: four positions or more, the last the first, are needed")
    corners = placing(corners)
    ring = _in_plan(corners[:-1], frame)
    ring = np.asarray(ring[(ring != np.roll(ring, 1, axis=0)).any(axis=1)])
    _refuse_crossing(ring, corners)
    if len(ring) < 3 or _area(ring) == 0.0:
        raise DivespotError("has no area: three corners that are not on one line are needed")
    return ring


def _positions(line: Any) -> NDArray[np.float64]:  # noqa: ANN401
    """Return positions unchanged: two or three finite numbers each."""
    rows = [row[:3] for row in line if isinstance(row, list)] if isinstance(line, list) else []
    numbers = [v for row in rows for v in row if type(v) in {int, float}]
    sizes = {len(row) for row in rows}
    try:
        flat = np.array(numbers, dtype=np.float64)
    except OverflowError:
        flat = np.array([math.inf])
    whole = len(rows) == len(line if isinstance(line, list) else ()) > 0
    if not whole or sizes not in ({2}, {3}) or flat.size != len(rows) * sizes.pop():
        raise DivespotError("has no proper positions: two or three numbers each are needed")
    if not np.isfinite(flat).all():
        raise DivespotError("has a position that is not finite: finite numbers are needed")
    return flat.reshape(len(rows), -1)


def _in_plan(corners: NDArray[np.float64], frame: Frame) -> NDArray[np.float64]:
    upright = abs(float(frame.pose.rotation[2, 2]))
    if upright >= math.cos(math.radians(PLAN_DEG)):
        return frame.plan_to_level(corners[:, :2])
    if corners.shape[1] == 2:
        raise DivespotError(
            "has x and y only, but the ground's normal is "
            f"{math.degrees(math.acos(upright)):.0f}° from the scan's z: x, y and z are needed"
        )
    return np.asarray(frame.to_level(corners)[:, :2])


def _area(ring: NDArray[np.float64]) -> float:
    """Return the area, positive if the line runs counter-clockwise."""
    x, y = (ring - ring[0]).T
    return twice_area(x, y) / 2.0


def _turned(ring: NDArray[np.float64], *, hole: bool) -> NDArray[np.float64]:
    return np.asarray(ring if (_area(ring) < 0.0) == hole else ring[::-1])


def _refuse_crossing(ring: NDArray[np.float64], corners: NDArray[np.float64]) -> None:
    """Refuse a line with edges that cross; edges may touch."""
    crossing = _native.first_crossing(ring)
    if crossing is not None:
        place = ", ".join(f"{v:.10g}" for v in corners[crossing])
        raise DivespotError(f"crosses itself after ({place}): a simple line is needed")
