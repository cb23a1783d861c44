"""The piles' outlines as GeoJSON, with their measured values."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from divespot._arguments import require_kind
from divespot.output import refuse_inputs, write_text
from divespot.report import Report, finite
from divespot.results.crs_name import crs_name, epsg

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

    from divespot.directions import Position
    from divespot.intake import Source
    from divespot.report import Pile

#: Fields of a pile that are not attributes of its outline.
_ELSEWHERE = ("id", "outline_m", "centroid_m", "budget", "volume_by_base_m3", "reason")


def save_outlines(report: Report, path: str | os.PathLike[str]) -> None:
    """Write the piles' outlines as GeoJSON, in the scan's own frame and unit.

    Each outline has the pile's values as attributes. If the scan's system has an EPSG code, it is
    stated as in GeoJSON before RFC 7946, which GIS programs read. Later scans may be measured
    inside the outlines: ``outline=path``.

    Raises
    ------
    DivespotError
        The file cannot be written.

    Examples
    --------
    >>> import divespot
    >>> from divespot import simulate
    >>> scan = simulate.scan("shape-05", density=0.03)
    >>> divespot.save_outlines(divespot.measure(scan.points), "piles.geojson")
    >>> len(divespot.measure(scan.points, outline="piles.geojson").piles)
    1

    """
    require_kind("report", report, Report)
    refuse_inputs(path, "the outlines", report.inputs)
    write_text(path, json.dumps(finite(collection(report)), indent=1, allow_nan=False) + "\n")


def collection(report: Report) -> dict[str, Any]:
    """Return the piles' outlines as a GeoJSON FeatureCollection."""
    piles = (pile for pile in report.piles if pile.outline_m)
    return of_lines([(attributes(pile), pile.outline_m) for pile in piles], report.source)


def of_lines(
    features: Iterable[tuple[dict[str, Any], tuple[Position, ...]]], source: Source
) -> dict[str, Any]:
    """Return outlines with their attributes as a GeoJSON FeatureCollection."""
    code = epsg(source.crs)
    named = {"name": f"urn:ogc:def:crs:EPSG::{code}"}
    return {
        "type": "FeatureCollection",
        "generator": "divespot",
        **({} if code is None else {"crs": {"type": "name", "properties": named}}),
        "scan": source.path,
        "scan_unit": source.unit,
        "scan_crs": crs_name(source.crs),
        "features": [_feature(about, line) for about, line in features],
    }


def attributes(pile: Pile) -> dict[str, Any]:
    """Return the values of a pile that its outline has as attributes."""
    return {"pile": pile.id, **{k: v for k, v in vars(pile).items() if k not in _ELSEWHERE}}


def _feature(about: dict[str, Any], line: tuple[Position, ...]) -> dict[str, Any]:
    return {
        "type": "Feature",
        "properties": about,
        "geometry": {"type": "Polygon", "coordinates": [_closed(line)]},
    }


def _closed(line: tuple[Position, ...]) -> list[list[float]]:
    return [list(corner) for corner in (*line, *line[:1])]
