"""Classified points as LAS, and heights as GeoTIFF: round trips."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Report
from divespot import io as dio
from divespot.cli import main
from divespot.cli.results import FILES
from divespot.results.las_points import save_las
from divespot.results.mesh import mesh, save_mesh
from divespot.results.pile_matching import labels
from divespot.simulate import scan

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

WKT = (
    'PROJCS["ETRS89 / UTM zone 32N",GEOGCS["ETRS89",DATUM["x",SPHEROID["GRS 1980",6378137,298]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925]],PROJECTION["Transverse_Mercator"],'
    'PARAMETER["scale_factor",0.9996],UNIT["metre",1],AUTHORITY["EPSG","25832"]]'
)


@cache
def points() -> Any:  # noqa: ANN401
    """Three piles, upright, in UTM."""
    found = scan("three-piles", density=0.1)
    placed = found.in_scene(found.points[np.isfinite(found.points).all(axis=1)])
    return placed + np.array([482_310.0, 5_456_790.0, 312.0])


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    """Return a LAS file with more dimensions than x, y and z, and a reference system."""
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-4), np.floor(points().min(axis=0))
    header.global_encoding.wkt = True
    header.vlrs.append(laspy.VLR("LASF_Projection", 2112, "WKT", WKT.encode() + b"\0"))
    header.add_extra_dim(laspy.ExtraBytesParams("own", "float32"))
    las = laspy.LasData(header)
    las.xyz = points()
    rng = np.random.default_rng(0)
    for name in ("intensity", "red", "classification"):
        las[name] = rng.integers(0, 3, len(las.points))
    las["own"] = rng.random(len(las.points))
    path = tmp_path / "flight.laz"
    las.write(path)
    return path


@pytest.mark.parametrize("ending", ["las", "laz"])
def test_every_point_and_dimension_is_kept(ending: str, flight: Path, tmp_path: Path) -> None:
    report, out = divespot.measure(flight), tmp_path / f"out.{ending}"
    report.save(out)
    before, after = laspy.read(flight), laspy.read(out)
    assert after.header.point_format.id == before.header.point_format.id
    assert (after.header.scales == before.header.scales).all()
    for name in before.point_format.dimension_names:
        if name != "classification":
            assert (after[name] == before[name]).all(), name
    assert set(np.unique(after["pile"])) == {0, 1, 2, 3}
    assert set(np.unique(after.classification)) == {1, 2}
    again = divespot.measure(out)
    assert again.source.crs == report.source.crs == WKT
    assert again.total == report.total
    report.save(out)  # over its own


def test_points_are_of_what_they_lie_on(flight: Path, tmp_path: Path) -> None:
    report, out = divespot.measure(flight), tmp_path / "out.las"
    save_las(report, out)
    found = laspy.read(out)
    pile, kind = np.asarray(found["pile"]), np.asarray(found.classification)
    assert not (kind[pile > 0] == 2).any()
    # What is called ground lies level; what is of a pile gives its volume back.
    assert np.ptp(np.asarray(found.z)[kind == 2]) < 0.05
    assert (kind == 2).mean() > 0.4
    for one in report.piles:
        own = found.xyz[pile == one.id]
        assert np.abs(own[:, :2].mean(axis=0) - one.centroid_m[:2]).max() < 0.05
        assert own[:, 2].max() - 312.0 == pytest.approx(one.max_height_m, abs=0.02)
    alone = divespot.measure(out, classes="1,2")
    assert alone.total == report.total


def test_points_are_written_batch_by_batch(
    flight: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    las = laspy.read(flight)
    las.classification = np.where(np.arange(len(las.points)) % 10 == 0, 7, las.classification)
    tiles = [tmp_path / "a.laz", tmp_path / "b.laz"]
    cut = np.asarray(las.x) < np.median(las.x)
    for tile, part in zip(tiles, (cut, ~cut), strict=True):
        laspy.LasData(las.header, las.points[part]).write(tile)
    report, alone = divespot.measure(tiles), divespot.measure(flight)

    def holds_it(*_: object) -> Any:  # noqa: ANN401 - nothing
        raise AssertionError

    monkeypatch.setattr("divespot.results.las_points.BATCH", 10_000)
    monkeypatch.setattr("divespot.results.las_points.bytes_of", holds_it)
    monkeypatch.setattr("divespot.results.las_points.read", holds_it)
    report.save(tmp_path / "both.laz")
    found = laspy.read(tmp_path / "both.laz")
    assert len(found.points) == report.source.points == (las.classification != 7).sum()
    assert found.header.parse_crs() is not None or WKT in str(found.header.vlrs)
    for pile in report.piles:
        own = found.xyz[np.asarray(found["pile"]) == pile.id]
        assert np.abs(own[:, :2].mean(axis=0) - pile.centroid_m[:2]).max() < 0.05
    alone.save(tmp_path / "one.las")
    assert len(laspy.read(tmp_path / "one.las").points) == len(las.points)


def test_another_format_becomes_las(tmp_path: Path) -> None:
    path, out = tmp_path / "scan.ply", tmp_path / "out.laz"
    dio.write(path, points())
    report = divespot.measure(path)
    save_las(report, out)
    assert divespot.measure(out).total.volume_m3 == pytest.approx(
        report.total.volume_m3, abs=report.total.u95_m3 / 10
    )
    assert len(laspy.read(out).points) == len(points())


def test_what_has_no_file_has_no_points(tmp_path: Path) -> None:
    report = divespot.measure(points())
    with pytest.raises(DivespotError, match="array was measured"):
        save_las(report, tmp_path / "a.las")
    with pytest.raises(DivespotError, match=r"\.las, \.laz"):
        save_las(report, tmp_path / "a.ply")
    lost = dataclasses.replace(report.source, path=str(tmp_path / "none.las"))
    done = dataclasses.replace(report, source=lost)
    with pytest.raises((DivespotError, OSError)):
        save_las(done, tmp_path / "a.las")
    assert not (tmp_path / "a.las").exists()


# Rasters


def test_a_raster_holds_the_volume(flight: Path, tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio")
    pytest.importorskip("rasterio.transform")
    report, out = divespot.measure(flight), tmp_path / "out.tif"
    for _ in range(2):  # the second time over its own
        done = CliRunner().invoke(main, ["measure", str(flight), "--dem", str(out), "-q"])
        assert done.exit_code == 0, done.output
    with rasterio.open(out) as raster:
        surface, base, difference, seen = raster.read()
        assert raster.descriptions == ("surface", "base", "difference", "seen")
        assert raster.crs.to_epsg() == 25832
        assert np.isnan(raster.nodata)
        at = raster.transform
        cell_m2 = abs(at.a * at.e - at.b * at.d) / (report.source.scale_factor or 1.0) ** 2
        pile = labels(report.piles, report.level.frame, report.level)[::-1]
        assert not np.isnan(difference[pile > 0]).any()
        known = ~np.isnan(report.level.height_map.heights_m)[::-1]
        assert (seen == known).all()
        assert np.isnan(surface[~known & (pile == 0)]).all()
        for one in report.piles:
            volume = float(np.nansum(difference[pile == one.id])) * cell_m2
            assert volume == pytest.approx(one.volume_m3, rel=0.004)
            x, y, _ = one.centroid_m
            row, column = rasterio.transform.rowcol(at, x, y)
            assert pile[row, column] == one.id
            below = base[row, column]
            assert below == pytest.approx(312.0, abs=0.02)
            assert surface[row, column] == pytest.approx(below + difference[row, column], abs=1e-4)


def test_a_raster_of_what_is_no_plan_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from divespot.results.dem import save_dem  # noqa: PLC0415

    report = divespot.measure(points())
    save: Callable[[Report, Path], None] = save_dem
    with pytest.raises(DivespotError, match=r"\.tif"):
        save(report, tmp_path / "a.asc")
    sideways = divespot.measure(scan("three-piles", density=0.05).points[:, [2, 0, 1]], up="x")
    with pytest.raises(DivespotError, match="are needed for a raster"):
        save(sideways, tmp_path / "a.tif")
    monkeypatch.setitem(__import__("sys").modules, "rasterio", None)
    with pytest.raises(DivespotError, match=r"pip install divespot\[raster\]"):
        save(report, tmp_path / "a.tif")
    assert not list(tmp_path.iterdir())


# Meshes


def test_a_mesh_is_closed_and_holds_the_volume(flight: Path, tmp_path: Path) -> None:
    report, out = divespot.measure(flight), tmp_path / "out.ply"
    for _ in range(2):
        report.save(out)
    nodes, faces = mesh(report)
    head = out.read_bytes()[:600]
    assert f"element vertex {len(nodes)}\n".encode() in head
    assert f"element face {len(faces)}\n".encode() in head
    for pile in report.piles:
        own = faces["nodes"][faces["pile"] == pile.id].astype(np.int64)
        edges = np.concatenate([own[:, [0, 1]], own[:, [1, 2]], own[:, [2, 0]]])
        forth = {tuple(edge) for edge in edges.tolist()}
        assert len(forth) == len(edges)
        assert forth == {(b, a) for a, b in forth}, "each edge lies between two faces"
        a, b, c = (nodes[own[:, i]] - pile.centroid_m for i in range(3))
        volume = float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0
        assert volume == pytest.approx(pile.volume_m3, rel=0.01)


def test_a_mesh_of_no_pile_is_empty(tmp_path: Path) -> None:
    report = dataclasses.replace(divespot.measure(points()), piles=())
    save_mesh(report, tmp_path / "a.ply")
    assert b"element face 0\n" in (tmp_path / "a.ply").read_bytes()
    with pytest.raises(DivespotError, match=r"\.ply"):
        save_mesh(report, tmp_path / "a.obj")


# All of it


def test_one_command_writes_every_output(flight: Path, tmp_path: Path) -> None:
    for extra in ("matplotlib", "jinja2", "plotly", "typst", "rasterio", "pyogrio"):
        pytest.importorskip(extra)
    endings = {"save_base": ".ply", "geojson": ".geojson"}
    outputs = [
        (item.flags[0], tmp_path / f"{item.name}{endings.get(item.name) or item.endings[0]}")
        for item in FILES
    ]
    outputs += [(f"--{name}", tmp_path / f"a.{name}") for name in ("json", "csv", "history")]
    arguments = [str(part) for pair in outputs for part in pair]
    done = CliRunner().invoke(main, ["measure", str(flight), *arguments, "--material", "corn"])
    assert done.exit_code == 0, done.output
    assert "pile 3" in done.stdout
    assert all(path.stat().st_size > 500 for _, path in outputs)
