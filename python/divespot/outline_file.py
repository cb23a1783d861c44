"""Outlines as GeoJSON: what to measure inside of."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from divespot import _native
from divespot.errors import DivespotError, shortened
from divespot.io.files import bytes_of
from divespot.outline_checks import first_overlap, refuse_degrees

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.frame import Frame

#: The path of a GeoJSON file, or what it holds.
Outlines: TypeAlias = str | os.PathLike[str] | Mapping[str, Any]

#: Largest file of outlines that is read.
LARGEST_BYTES = 256 << 20

#: Largest angle between the ground's normal and the scan's z at which x and y are a plan of it.
PLAN_DEG = 45.0


@dataclass(frozen=True, eq=False)
class Region:
    """An area to measure inside of.

    Attributes
    ----------
    name
        What the file calls it; None where it does not.
    rings
        Lines of shape ``(n, 2)`` in the level frame, not closed, those around the area
        counter-clockwise, its holes clockwise; the largest line first.

    """

    name: str | None
    rings: tuple[NDArray[np.float64], ...]


def read_regions(outline: Outlines, frame: Frame) -> list[Region]:
    """Read Polygons and MultiPolygons, one region a feature, from a file or GeoJSON as a dict.

    x and y are those of the scan, in its unit. A third coordinate counts only where the scan's x
    and y are no plan of its ground; then it is needed.

    Raises
    ------
    DivespotError
        The file cannot be read, holds no polygon or something else, or a line is not closed,
        crosses itself or has no area.

    """
    path = name_of(outline)
    try:
        parsed = outline if isinstance(outline, Mapping) else _parsed(Path(outline))
        regions = [_region(i, *feature, frame) for i, feature in enumerate(_features(parsed), 1)]
        _refuse_overlap(regions)
    except OSError as error:
        raise DivespotError(f"{path}: cannot be read ({error.strerror})") from None
    except DivespotError as error:
        raise DivespotError(f"{path}: {error}") from None
    except (ValueError, RecursionError) as error:
        raise DivespotError(f"{path}: is no JSON ({error})") from None
    return regions


def name_of(outline: Outlines) -> str:
    """Return what errors call an outline: its path, if it has one."""
    return "outline" if isinstance(outline, Mapping) else os.fspath(outline)


def _parsed(path: Path) -> Any:  # noqa: ANN401 - any JSON value
    return json.loads(bytes_of(path, LARGEST_BYTES))


def _refuse_overlap(regions: list[Region]) -> None:
    found = first_overlap([region.rings for region in regions])
    if found is not None:
        one, other = (_what(i + 1, regions[i].name) for i in found)
        raise DivespotError(f"{one} and {other} overlap: what both cover would count twice")


def _features(parsed: Any) -> list[tuple[str | None, Any]]:  # noqa: ANN401 - any JSON value
    """Return name and geometry of everything in the file."""
    kind = parsed.get("type") if isinstance(parsed, Mapping) else None
    if kind == "Feature":
        return [_named(parsed)]
    if kind != "FeatureCollection":
        return [(None, parsed)]
    features = parsed.get("features")
    if not isinstance(features, list) or not features:
        raise DivespotError("it holds no feature: a Polygon or MultiPolygon is needed")
    return [_named(feature) for feature in features]


def _named(feature: Any) -> tuple[str | None, Any]:  # noqa: ANN401
    if not isinstance(feature, dict):
        return None, None
    properties = feature.get("properties")
    known = properties if isinstance(properties, dict) else {}
    names = (known.get("name"), feature.get("id"), known.get("id"))
    name = next((str(name) for name in names if isinstance(name, str | int)), None)
    return name, feature.get("geometry")


def _region(number: int, name: str | None, geometry: Any, frame: Frame) -> Region:  # noqa: ANN401
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    what = _what(number, name)
    if kind not in ("Polygon", "MultiPolygon"):
        raise DivespotError(f"{what} is {kind or 'no geometry'}: Polygon or MultiPolygon is needed")
    coordinates = geometry.get("coordinates")
    polygons = [coordinates] if kind == "Polygon" else coordinates
    if not isinstance(polygons, list) or not polygons or not all(map(_is_filled, polygons)):
        raise DivespotError(f"{what} has no lines: coordinates of a {kind} are needed")
    try:
        parts = [[_ring(line, frame) for line in polygon] for polygon in polygons]
    except DivespotError as error:
        raise DivespotError(f"{what} {error}") from None
    rings = [_turned(ring, hole=i > 0) for part in parts for i, ring in enumerate(part)]
    return Region(name, tuple(sorted(rings, key=_area, reverse=True)))


def _what(number: int, name: str | None) -> str:
    return f"outline {number}" + (f" ({shortened(name, 60)})" if name else "")


def _is_filled(polygon: Any) -> bool:  # noqa: ANN401
    return isinstance(polygon, list) and len(polygon) > 0


def _ring(line: Any, frame: Frame) -> NDArray[np.float64]:  # noqa: ANN401
    """Return a closed line's corners in the level frame, the last one not repeated."""
    corners = _positions(line)
    if len(corners) < 4 or (corners[0] != corners[-1]).any():
        raise DivespotError("is not closed: four positions or more, the last the first, are needed")
    refuse_degrees(corners, frame.origin_m / frame.metres)
    ring = _in_plan(corners[:-1], frame)
    ring = np.asarray(ring[(ring != np.roll(ring, 1, axis=0)).any(axis=1)])
    _refuse_crossing(ring, corners)
    if len(ring) < 3 or _area(ring) == 0.0:
        raise DivespotError("has no area: three corners that are not on one line are needed")
    return ring


def _positions(line: Any) -> NDArray[np.float64]:  # noqa: ANN401
    """Return positions as they are: two or three finite numbers each."""
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
        raise DivespotError("has a position that is not finite")
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
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


def _turned(ring: NDArray[np.float64], *, hole: bool) -> NDArray[np.float64]:
    return np.asarray(ring if (_area(ring) < 0.0) == hole else ring[::-1])


def _refuse_crossing(ring: NDArray[np.float64], corners: NDArray[np.float64]) -> None:
    """Refuse a line two of whose edges cross; edges may touch."""
    crossing = _native.first_crossing(ring)
    if crossing is not None:
        place = ", ".join(f"{v:.10g}" for v in corners[crossing])
        raise DivespotError(f"crosses itself after ({place}): a simple line is needed")
