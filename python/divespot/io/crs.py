"""Units of a coordinate reference system, from its WKT or its GeoTIFF keys.

Only the units are needed, so that no projection library is. Sources: OGC 01-009 (WKT 1),
OGC 18-010 (WKT 2), OGC 19-008 (GeoTIFF keys), EPSG codes of units and systems.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from divespot.io.epsg import projected_unit, vertical_unit
from divespot.io.units import DEGREES, STRETCHED, unit_named, unit_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|([\[(])|([\])])|([^\[\]()",\s]+)')
_PROJECTED = {"PROJCS", "PROJCRS", "PROJECTEDCRS"}
_CARTESIAN = {"GEOCCS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"}
_GEODETIC = {"GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"}
# VERTCS is ESRI's keyword.
_VERTICAL = {"VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"}
# Projections whose metre is true on one parallel only; transverse and oblique ones are not.
_STRETCHED = re.compile(
    r"mercator|popularvisualisation|equidistantcylindrical|equirectangular|platecarree"
)
_FEET = re.compile(
    r"(?i)(?<![a-z])(us|u\.s\.)?[\s_-]*(?:survey)?[\s_-]*(ftus|ft|foot|feet)(?![a-z])"
)
_EPSG_UNITS_M = {9001: 1.0, 9002: 0.3048, 9003: 1200.0 / 3937.0, 1025: 0.001, 1033: 0.01, 9036: 1e3}
_USER_DEFINED = 32767
# GeoTIFF has no key for the size of a user-defined vertical unit.
_NO_KEY = -1
# GTModelTypeGeoKey: 1 is a projected system, 2 a geographic, 3 a geocentric one.
_PROJECTED_MODEL, _GEOGRAPHIC_MODEL = 1, 2


@dataclass(frozen=True)
class Crs:
    """The reference system that a file states.

    `unit` is that of x and y, `vertical_unit` that of z if it has its own. Both are keys of
    `UNITS`, or `DEGREES`, or `STRETCHED`, or text for a unit that is not in `UNITS`. In a
    `projected` system z is up.
    """

    text: str | None = None
    unit: str | None = None
    vertical_unit: str | None = None
    projected: bool = False
    warnings: tuple[str, ...] = ()


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
    """Return the units that WKT (1 or 2) states; none for text that is not WKT."""
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
        return STRETCHED if _is_stretched(system) else _length_unit(system, projected_unit)
    system = _find(root, _GEODETIC)
    if system is None:
        return None
    cartesian = any(c.keyword == "CS" and "Cartesian" in c.values for c in system.children)
    return _length_unit(system, projected_unit) if cartesian else DEGREES


def _is_stretched(system: _Node) -> bool:
    named = ("PROJECTION", "METHOD")
    methods = (node.values[0] for node in system.walk() if node.keyword in named and node.values)
    return any(_STRETCHED.match(re.sub(r"[^a-z]", "", method.lower())) for method in methods)


def _vertical_unit(root: _Node) -> str | None:
    system = _find(root, _VERTICAL)
    return _length_unit(system, vertical_unit) if system is not None else None


def _length_unit(system: _Node, by_code: Callable[[int], str | None]) -> str | None:
    """Return the unit of the system itself, of its axes, or by its code; not that of its parts."""
    places = [system, *(child for child in system.children if child.keyword == "AXIS")]
    for place in places:
        units = [c for c in place.children if c.keyword in ("UNIT", "LENGTHUNIT")]
        if units:
            return _unit_of_node(units[-1])
    codes = (child.values for child in system.children if child.keyword in ("AUTHORITY", "ID"))
    code = next((c[1] for c in codes if len(c) > 1 and c[0].upper() == "EPSG"), "")
    return by_code(int(code)) if code.isdecimal() and len(code) < 9 else None


def _unit_of_node(node: _Node) -> str | None:
    """Return a unit by its size, or by its name if the size is missing."""
    try:
        return unit_of(float(node.values[1]))
    except (IndexError, ValueError):
        name = node.values[0] if node.values else ""
        return unit_named(name) or name or None


def crs_from_geokeys(keys: Mapping[int, int | float | str]) -> Crs:
    """Return the system that GeoTIFF keys state, given as key id to value."""
    projected, geographic, vertical = (_code(keys.get(key)) for key in (3072, 2048, 4096))
    is_geographic = keys.get(1024) == _GEOGRAPHIC_MODEL
    code = geographic if is_geographic else projected
    citation = str(keys.get(1026) or keys.get(3073) or "")
    text = f"EPSG:{code}" if code else citation
    if is_geographic:
        unit: str | None = DEGREES
    else:
        by_code = projected_unit(projected) if projected else _unit_in(citation)
        unit = by_code if by_code == STRETCHED else _geokey_unit(keys, 3076, 3077) or by_code
    height = _geokey_unit(keys, 4099, _NO_KEY) or (vertical_unit(vertical) if vertical else None)
    is_projected = keys.get(1024) == _PROJECTED_MODEL
    doubt = _not_known(code) if code and unit is None else ()
    return Crs(text or None, unit, height, is_projected, doubt)


def _code(value: float | str | None) -> int:
    """Return the EPSG code in a key; 0 if there is none."""
    known = isinstance(value, int) and value not in (0, _USER_DEFINED)
    return int(value) if known and value is not None else 0


def _unit_in(citation: str) -> str | None:
    """Return the kind of foot at the end of a system's name, as in state plane systems."""
    found = _FEET.search(citation)
    if found is None:
        return None
    return "us-ft" if found[1] or found[2].lower() == "ftus" else "ft"


def _not_known(code: int) -> tuple[str, ...]:
    return (
        f"EPSG:{code} is not known here, nor its unit: it is needed, or pip install divespot[crs]",
    )


def _geokey_unit(keys: Mapping[int, int | float | str], code_key: int, size_key: int) -> str | None:
    code = keys.get(code_key)
    if code is None:
        return None
    if code == _USER_DEFINED and size_key in keys:
        return unit_of(float(keys[size_key]))
    factor = _EPSG_UNITS_M.get(_code(code))
    return unit_of(factor) if factor is not None else f"EPSG unit {code}"
