"""Coordinate reference systems through pyproj (the extra ``crs``), if it is installed."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.extras import extra, is_installed

if TYPE_CHECKING:
    from divespot.io.scan import FloatArray

#: Length, in units of the map, over which its scale is computed.
BASELINE = 1000.0

#: Distance beyond a system's area of use that is accepted, since surveys cross borders of zones.
BEYOND_DEG = 1.0


_STATES_ONE = re.compile(
    r"\s*((urn:ogc:def:crs:)?(EPSG|OGC):[\w.]*:?(\d+(\+\d+)?|CRS84)\s*\Z|\w+\s*\[)", re.IGNORECASE
)


def known_system(text: str | None) -> Any | None:  # noqa: ANN401 - pyproj is optional
    """Return the horizontal system that WKT, a code or a name stands for.

    None if it stands for none, or pyproj is missing. Names are not searched for, since that takes a
    second and may find another system.
    """
    if not text or not _STATES_ONE.match(text) or not is_installed("pyproj"):
        return None
    pyproj = extra("pyproj", "crs", "a reference system needs pyproj")
    try:
        system = pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError:
        return None
    return system.sub_crs_list[0] if system.is_compound else system


def require_system(text: str) -> Any:  # noqa: ANN401 - as above
    """Return the system that a user named, including heights.

    Raises
    ------
    DivespotError
        There is no such system, or pyproj is missing.

    """
    pyproj = extra("pyproj", "crs", "a reference system that is given needs pyproj")
    try:
        if _STATES_ONE.match(text):
            return pyproj.CRS.from_user_input(text)
    except pyproj.exceptions.CRSError:
        pass
    raise DivespotError(f"crs is {text[:60]!r}: EPSG:CODE or WKT is needed")


def is_same_system(one: str, other: str) -> bool:
    """Return whether two texts mean one system; without pyproj, whether they are equal."""
    if "".join(one.split()) == "".join(other.split()):
        return True
    a, b = known_system(one), known_system(other)
    return a is not None and b is not None and bool(a.equals(b, ignore_axis_order=True))


def scale_factor(text: str | None, place: FloatArray) -> float | None:
    """Return the length on the map per length on the ellipsoid, at a position x, y of the map.

    It is the square root of the ratio of areas. None if it cannot be determined.
    """
    system = known_system(text)
    if system is None or not system.is_projected:
        return None
    pyproj = extra("pyproj", "crs", "the scale of a projection needs pyproj")
    unit_m = system.axis_info[0].unit_conversion_factor
    to_ellipsoid = pyproj.Transformer.from_crs(system, system.geodetic_crs, always_xy=True)
    ends = np.asarray(place)[:2] + 0.5 * BASELINE * np.array([[-1, 0], [1, 0], [0, -1], [0, 1]])
    lon, lat = to_ellipsoid.transform(ends[:, 0], ends[:, 1])
    if not np.isfinite([lon, lat]).all() or not _is_used_at(system, lon[0], lat[0]):
        return None
    _, _, across_m = system.get_geod().inv(lon[::2], lat[::2], lon[1::2], lat[1::2])
    scale = BASELINE * unit_m / np.sqrt(float(np.prod(across_m)))
    return float(scale) if 0.5 < scale < 2.0 else None


def _is_used_at(system: Any, lon: float, lat: float) -> bool:  # noqa: ANN401 - pyproj's
    """Return whether a position is in a system's area of use, or that area is not stated."""
    area = system.area_of_use
    if area is None:
        return True
    # Areas across the antimeridian end at a smaller longitude than they begin at.
    wide = (area.east - area.west) % 360.0 or 360.0
    east = (lon - area.west + BEYOND_DEG) % 360.0 <= wide + 2.0 * BEYOND_DEG
    return bool(east and area.south - BEYOND_DEG <= lat <= area.north + BEYOND_DEG)


def reprojected(plan: FloatArray, source: Any, target: Any) -> FloatArray:  # noqa: ANN401 - as above
    """Return x, y, shape (n, 2), reprojected to another system; inf where undefined."""
    pyproj = extra("pyproj", "crs", "to reproject needs pyproj")
    transformer = pyproj.Transformer.from_crs(source, target, always_xy=True)
    return np.column_stack(transformer.transform(plan[:, 0], plan[:, 1]))
