"""The piles' outlines as a GeoPackage, with their measured values."""

from __future__ import annotations

import warnings
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import require_kind
from divespot.errors import encodable
from divespot.extras import extra
from divespot.output import other_ending, refuse_inputs, whole
from divespot.report import Report
from divespot.results.outlines import attributes

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from divespot.directions import Position

#: A later run recognizes its own files by this; see `divespot.output.GEOPACKAGE`.
MARK = "written by divespot"

LAYER = "piles"


def save_gpkg(report: Report, path: str | os.PathLike[str]) -> None:
    """Write the piles' outlines as a GeoPackage.

    They are in the scan's own frame, unit and reference system, with the pile's values as
    attributes, without those that no pile has. Later scans may be measured inside the
    outlines: ``outline=path``.

    Raises
    ------
    DivespotError
        The ending is unknown, the extra ``gis`` is missing, or the file cannot be written.

    """
    require_kind("report", report, Report)
    if not str(path).lower().endswith(".gpkg"):
        raise other_ending(path, "a GeoPackage", (".gpkg",))
    refuse_inputs(path, "the outlines", report.inputs)
    piles = [pile for pile in report.piles if pile.outline_m]
    rows = [attributes(pile) for pile in piles]
    data = layer(rows, [pile.outline_m for pile in piles], report.source.crs)
    with whole(path) as stream:
        stream.write(data)


def layer(
    rows: Sequence[Mapping[str, Any]],
    outlines: Sequence[tuple[Position, ...]],
    system: str | None,
    name: str = LAYER,
) -> bytes:
    """Return a GeoPackage of one layer of polygons, each with its row of attributes."""
    need = "a GeoPackage needs {}"
    pyogrio = extra("pyogrio", "gis", need.format("pyogrio"))
    shapely = extra("shapely", "gis", need.format("shapely"))
    areas = shapely.to_wkb([shapely.Polygon(line) for line in outlines])
    names = [key for key in (rows[0] if rows else ()) if any(row[key] is not None for row in rows)]
    about: dict[str, Any] = {
        "geometry": np.array(areas, dtype=object),
        "fields": names,
        "field_data": [_column([row[key] for row in rows]) for key in names],
        "geometry_type": "Polygon Z",
        "driver": "GPKG",
        "layer": name,
        "layer_options": {"DESCRIPTION": MARK},
    }
    with TemporaryDirectory(prefix="divespot-") as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about unknown systems
        file = Path(folder) / "layer.gpkg"
        try:
            pyogrio.raw.write(file, crs=system, **about)
        except pyogrio.errors.CRSError:  # a local system, which GDAL does not know
            pyogrio.raw.write(file, crs=None, **about)
        return file.read_bytes()


def _column(values: list[Any]) -> NDArray[Any]:
    """Return a column of one type: numbers, booleans, or texts and None."""
    known = [value for value in values if value is not None]
    if known and all(isinstance(value, bool) for value in known):
        return np.array(values, dtype=np.bool_)
    if known and all(isinstance(value, int) for value in known):
        return np.array(values, dtype=np.int64)
    if known and all(isinstance(value, int | float) for value in known):
        return np.array([np.nan if value is None else value for value in values])
    texts = [None if value is None else encodable(str(value)) for value in values]
    return np.array(texts, dtype=object)
