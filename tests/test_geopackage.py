"""Outlines as a GeoPackage: what a GIS reads of them."""

from __future__ import annotations

import dataclasses
import sqlite3
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Report
from divespot.cli import main
from divespot.results.geopackage import save_gpkg
from divespot.simulate import scan

if TYPE_CHECKING:
    from pathlib import Path

pyogrio = pytest.importorskip("pyogrio", reason="the extra gis is not installed")
shapely = pytest.importorskip("shapely", reason="the extra gis is not installed")


@cache
def measured() -> Report:
    found = scan("three-piles", density=0.03)
    points = found.in_scene(found.points[np.isfinite(found.points).all(axis=1)])
    points += np.array([482_310.0, 5_456_790.0, 312.0])
    report = divespot.measure(points, crs="EPSG:25832", up="z", material="corn")
    named = dataclasses.replace(report.piles[0], name="Süd & \udcff")
    return dataclasses.replace(report, piles=(named, *report.piles[1:]))


def test_a_gis_reads_what_was_measured(tmp_path: Path) -> None:
    report, path = measured(), tmp_path / "piles.gpkg"
    report.save(path)
    about, _, areas, columns = pyogrio.raw.read(path)
    assert (about["crs"], about["geometry_type"]) == ("EPSG:25832", "Polygon Z")
    found = dict(zip(about["fields"].tolist(), columns, strict=True))
    for name in ("volume_m3", "u95_m3", "mass_kg", "seen_fraction", "touches_edge"):
        assert found[name].tolist() == [getattr(pile, name) for pile in report.piles]
    assert found["pile"].tolist() == [1, 2, 3]
    assert found["name"].tolist() == ["Süd & ?", None, None]
    assert found["material"].tolist() == ["corn"] * 3
    for area, pile in zip(shapely.from_wkb(areas), report.piles, strict=True):
        assert area.area == pytest.approx(pile.footprint_m2, rel=0.1)
        assert list(area.exterior.coords)[:-1] == list(pile.outline_m)
    report.save(path)  # over its own


def test_piles_are_measured_again_inside_their_outlines(tmp_path: Path) -> None:
    path = tmp_path / "piles.gpkg"
    save_gpkg(measured(), path)
    found = scan("three-piles", density=0.03)
    points = found.in_scene(found.points[np.isfinite(found.points).all(axis=1)])
    points += np.array([482_310.0, 5_456_790.0, 312.0])
    again = divespot.measure(points, crs="EPSG:25832", up="z", outline=path)
    for one, other in zip(again.piles, measured().piles, strict=True):
        assert one.volume_m3 == pytest.approx(other.volume_m3, rel=0.05)
    assert again.piles[0].name == "Süd & ?"


def test_of_no_pile_the_layer_is_empty_and_an_own_system_is_none(tmp_path: Path) -> None:
    path = tmp_path / "none.gpkg"
    empty = dataclasses.replace(measured(), piles=())
    own = dataclasses.replace(empty.source, crs='ENGCRS["plant",EDATUM["peg"]')
    save_gpkg(dataclasses.replace(empty, source=own), path)
    about = pyogrio.read_info(path)
    assert (about["features"], about["crs"]) == (0, None)


def test_what_divespot_did_not_write_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "yours.gpkg"
    with sqlite3.connect(path) as base:
        base.execute("CREATE TABLE yours (mine)")
    before = path.read_bytes()
    with pytest.raises(DivespotError, match="divespot did not write"):
        measured().save(path)
    assert path.read_bytes() == before
    with pytest.raises(DivespotError, match=r"one of \.gpkg is needed"):
        save_gpkg(measured(), tmp_path / "a.geojson")
    refused = CliRunner().invoke(main, ["measure", "a.ply", "--gpkg", "b.shp"])
    assert refused.exit_code == 2
    assert ".gpkg" in refused.stderr
