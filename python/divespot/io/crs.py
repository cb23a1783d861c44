"""Units of a coordinate reference system, from its WKT or its GeoTIFF keys.

Only the units are wanted, so neither needs a projection library. Sources: OGC 01-009 (WKT 1),
OGC 18-010 (WKT 2), OGC 19-008 (GeoTIFF keys), EPSG codes of units.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from divespot.io.units import DEGREES, unit_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|([\[(])|([\])])|([^\[\]()",\s]+)')
_PROJECTED = {"PROJCS", "PROJCRS", "PROJECTEDCRS"}
_CARTESIAN = {"GEOCCS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"}
_GEODETIC = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"}
_VERTICAL = {"VERT_CS", "VERTCRS", "VERTICALCRS"}
_EPSG_UNITS_M = {9001: 1.0, 9002: 0.3048, 9003: 1200.0 / 3937.0, 1025: 0.001, 1033: 0.01, 9036: 1e3}
_USER_DEFINED = 32767
# GeoTIFF has no key for the size of a user-defined vertical unit.
_NO_KEY = -1
# GTModelTypeGeoKey: 1 is a projected system, 2 a geographic, 3 a geocentric one.
_PROJECTED_MODEL, _GEOGRAPHIC_MODEL = 1, 2


@dataclass(frozen=True)
class Crs:
    """What a file says of its reference system.

    `unit` is that of x and y, `vertical_unit` that of z where it has its own. Both are keys of
    `UNITS`, or `DEGREES`, or text that names a unit `UNITS` has not. In a `projected` system z
    is up.
    """

    text: str | None = None
    unit: str | None = None
    vertical_unit: str | None = None
    projected: bool = False


@dataclass(frozen=True)
class _Node:
    keyword: str
    values: list[str] = field(default_factory=list)
    children: list[_Node] = field(default_factory=list)

    def walk(self) -> Iterator[_Node]:
        """Yield this node and all below it, outer ones first."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.children))


def crs_from_wkt(text: str) -> Crs:
    """Return the units that WKT (1 or 2) states; what is not WKT states none."""
    root = _parse_wkt(text)
    projected = _find(root, _PROJECTED) is not None
    return Crs(text, _horizontal_unit(root), _vertical_unit(root), projected)


def _parse_wkt(text: str) -> _Node:
    root = _Node("")
    path = [root]
    for quoted, opening, closing, word in _TOKEN.findall(text):
        node = path[-1]
        if opening and node.values:
            child = _Node(node.values.pop().upper())
            node.children.append(child)
            path.append(child)
        elif closing and len(path) > 1:
            path.pop()
        elif not opening and not closing:
            node.values.append(word or quoted)
    return root


def _find(root: _Node, keywords: set[str]) -> _Node | None:
    return next((node for node in root.walk() if node.keyword in keywords), None)


def _horizontal_unit(root: _Node) -> str | None:
    system = _find(root, _PROJECTED) or _find(root, _CARTESIAN)
    if system is not None:
        return _length_unit(system)
    system = _find(root, _GEODETIC)
    if system is None:
        return None
    cartesian = any(c.keyword == "CS" and "Cartesian" in c.values for c in system.children)
    return _length_unit(system) if cartesian else DEGREES


def _vertical_unit(root: _Node) -> str | None:
    system = _find(root, _VERTICAL)
    return _length_unit(system) if system is not None else None


def _length_unit(system: _Node) -> str | None:
    """Return the unit of the system itself, or else of its axes; not of the parts inside it."""
    places = [system, *(child for child in system.children if child.keyword == "AXIS")]
    for place in places:
        units = [c for c in place.children if c.keyword in ("UNIT", "LENGTHUNIT")]
        if units:
            return _unit_of_node(units[-1])
    return None


def _unit_of_node(node: _Node) -> str | None:
    try:
        return unit_of(float(node.values[1]))
    except (IndexError, ValueError):
        return None


def crs_from_geokeys(keys: Mapping[int, int | float | str]) -> Crs:
    """Return what GeoTIFF keys state, given as key id to value."""
    projected, geographic = keys.get(3072, 0), keys.get(2048, 0)
    is_geographic = keys.get(1024) == _GEOGRAPHIC_MODEL
    code = geographic if is_geographic else projected
    citation = keys.get(1026) or keys.get(3073)
    text = f"EPSG:{code}" if code not in (0, _USER_DEFINED) else citation
    unit = DEGREES if is_geographic else _geokey_unit(keys, 3076, 3077)
    vertical_unit = _geokey_unit(keys, 4099, _NO_KEY)
    return Crs(str(text) if text else None, unit, vertical_unit, keys.get(1024) == _PROJECTED_MODEL)


def _geokey_unit(keys: Mapping[int, int | float | str], code_key: int, size_key: int) -> str | None:
    code = keys.get(code_key)
    if code is None:
        return None
    if code == _USER_DEFINED and size_key in keys:
        return unit_of(float(keys[size_key]))
    factor = _EPSG_UNITS_M.get(int(code))
    return unit_of(factor) if factor is not None else f"EPSG unit {code}"
