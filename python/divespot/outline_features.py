"""Reading files of outlines: GeoJSON; with pyogrio also GeoPackage, Shapefile, KML, DXF."""

from __future__ import annotations

import json
import os
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.io.files import bytes_of, require_regular

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Largest file of outlines that is read, in bytes.
LARGEST_BYTES = 256 << 20

#: Endings of files that are read by pyogrio.
GIS = (".gpkg", ".shp", ".kml", ".kmz", ".dxf", ".fgb", ".gml")

#: Attributes that may name an outline, and the one that names its material.
NAMES, MATERIAL = ("name", "label", "title", "id", "layer"), "material"


_SEPARATORS = re.compile(r"[\s_]+")


@dataclass(frozen=True)
class Feature:
    """A geometry of any type as GeoJSON, with its name and material."""

    name: str | None
    material: str | None
    geometry: Any


@dataclass(frozen=True)
class Features:
    """All features of a file, the reference system it states, and how many are not areas."""

    items: list[Feature]
    system: str | None = None
    passed_over: int = 0


def read_features(outline: str | os.PathLike[str] | Mapping[str, Any]) -> Features:
    """Read a file, or GeoJSON given as a dict.

    Raises
    ------
    DivespotError
        The file cannot be read, or holds no feature.
    OSError
        The file does not exist.

    """
    if isinstance(outline, Mapping):
        return Features(_in_json(outline), _system(outline))
    path = os.fspath(outline)
    if path.lower().endswith(GIS):
        return _by_pyogrio(path)
    try:
        parsed = json.loads(bytes_of(Path(path), LARGEST_BYTES))
    except (ValueError, RecursionError) as error:
        if isinstance(error, DivespotError):
            raise
        raise DivespotError(f"is no JSON ({error}): GeoJSON is needed") from None
    return Features(_in_json(parsed), _system(parsed))


def _in_json(parsed: Any) -> list[Feature]:  # noqa: ANN401 - any JSON value
    kind = parsed.get("type") if isinstance(parsed, Mapping) else None
    if kind == "Feature":
        return [_feature(parsed)]
    if kind != "FeatureCollection":
        return [Feature(None, None, parsed)]
    features = parsed.get("features")
    if not isinstance(features, list) or not features:
        raise DivespotError("it holds no feature: a Polygon or MultiPolygon is needed")
    return [_feature(feature) for feature in features]


def _system(parsed: Any) -> str | None:  # noqa: ANN401
    """Return the system that a file of the older GeoJSON of 2008 names."""
    member = parsed.get("crs") if isinstance(parsed, Mapping) else None
    properties = member.get("properties") if isinstance(member, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return name if isinstance(name, str) else None


def _feature(feature: Any) -> Feature:  # noqa: ANN401
    if not isinstance(feature, dict):
        return Feature(None, None, None)
    properties = feature.get("properties")
    known = properties if isinstance(properties, dict) else {}
    own = {"id": feature["id"]} if feature.get("id") is not None else {}
    return _attributed({**known, **own}, feature.get("geometry"))


def _attributed(attributes: Mapping[str, Any], geometry: Any) -> Feature:  # noqa: ANN401
    words = {
        str(key).lower(): str(value)
        for key, value in attributes.items()
        if isinstance(value, str | int) and not isinstance(value, bool) and str(value).strip()
    }
    name = next((words[key] for key in NAMES if key in words), None)
    material = words.get(MATERIAL)
    return Feature(name, _SEPARATORS.sub("-", material.lower()) if material else None, geometry)


def _by_pyogrio(path: str) -> Features:
    pyogrio = extra("pyogrio", "gis", "outlines of a GIS need pyogrio")
    shapely = extra("shapely", "gis", "outlines of a GIS need shapely")
    require_regular(Path(path), LARGEST_BYTES)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            layers = [str(name) for name, _ in pyogrio.list_layers(path)]
            found = [pyogrio.raw.read(path, layer=layer) for layer in layers]
            features = [item for layer in found for item in _of_layer(layer, shapely)]
    except (DivespotError, MemoryError):
        raise
    # pyogrio passes on exceptions of GDAL and NumPy.
    except Exception as error:  # noqa: BLE001
        raise DivespotError(f"no outline can be read from it ({error}): one is needed") from None
    areas = [item for item in features if item.geometry is not None]
    if not areas:
        raise DivespotError("it holds no area: a polygon or a closed line is needed")
    systems = {meta["crs"] for meta, *_ in found if meta["crs"]}
    if len(systems) > 1:
        raise DivespotError(f"its layers are in {' and '.join(sorted(systems))}: one is needed")
    return Features(areas, next(iter(systems), None), len(features) - len(areas))


def _of_layer(layer: tuple[Any, ...], shapely: Any) -> Iterator[Feature]:  # noqa: ANN401 - optional
    """Yield the features of a layer; the geometry of those that are not areas is None."""
    meta, _, geometries, columns = layer
    if geometries is None:
        return
    rows = zip(*columns, strict=True) if len(columns) else iter(lambda: (), None)
    for shape, row in zip(shapely.from_wkb(geometries), rows, strict=False):
        plain = (value.item() if hasattr(value, "item") else value for value in row)
        attributes = dict(zip(meta["fields"], plain, strict=True))
        yield _attributed(attributes, _area(shape, shapely))


def _area(shape: Any, shapely: Any) -> dict[str, Any] | None:  # noqa: ANN401
    """Return a polygon, or the area inside a closed line, as GeoJSON; None for anything else."""
    if shape is None:
        return None
    if shape.geom_type == "LineString" and shape.is_closed and len(shape.coords) > 3:
        shape = shapely.Polygon(shape.coords)
    if shape.geom_type not in {"Polygon", "MultiPolygon"} or shape.is_empty:
        return None
    parsed: dict[str, Any] = json.loads(shapely.to_geojson(shape))
    return parsed
