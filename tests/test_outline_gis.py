"""Outlines of a GIS: formats, reference systems, names and materials from attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import MATERIALS, DivespotError, Report
from divespot.cli.tables import report_table
from divespot.io.systems import known_system, reprojected
from divespot.results.csv_rows import rows_of
from divespot.results.document import Document, Survey
from divespot.results.outlines import collection
from divespot.results.show_units import Shown
from io_samples import las
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

pyogrio = pytest.importorskip("pyogrio", reason="the extra gis is not installed")
shapely = pytest.importorskip("shapely", reason="the extra gis is not installed")

CONE = sampled(SOLIDS["cone"], 2.0**-6, (1.25, 1.125))
VOLUME_M3 = SOLIDS["cone"].volume_m3
# Far enough from the central meridian of UTM for a scale of 1 to some ppm.
AT = np.array([680_400.0, 5_391_000.0, 120.0])
UTM32 = {1024: 1, 3072: 32632, 3076: 9001}
DRIVERS = {
    ".gpkg": "GPKG",
    ".shp": "ESRI Shapefile",
    ".fgb": "FlatGeobuf",
    ".kml": "KML",
    ".dxf": "DXF",
}
SQUARE = AT[:2] + 0.75 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1.0]])


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scan") / "a.las"
    path.write_bytes(las(CONE + AT, scale=1e-5, geokeys=UTM32))
    return path


def saved(
    path: Path,
    *shapes: Any,  # noqa: ANN401 - shapely ships no types
    system: str = "EPSG:32632",
    **columns: list[Any],
) -> str:
    driver = DRIVERS[path.suffix]
    geometries = np.array([shapely.to_wkb(shape) for shape in shapes], dtype=object)
    pyogrio.raw.write(
        *(str(path), geometries),
        field_data=[np.array(values) for values in columns.values()],
        fields=list(columns),
        driver=driver,
        crs=None if driver == "DXF" else system,
        geometry_type=shapes[0].geom_type if len({s.geom_type for s in shapes}) == 1 else "Unknown",
    )
    return str(path)


def in_system(plan: NDArray[np.float64], system: str) -> NDArray[np.float64]:
    return reprojected(plan, known_system("EPSG:32632"), known_system(system))


def require_the_cone(report: Report) -> None:
    (pile,) = report.piles
    assert pile.volume_m3 == pytest.approx(VOLUME_M3, rel=1e-3)
    assert pile.footprint_m2 == pytest.approx(1.5**2, rel=1e-4)


@pytest.mark.parametrize("suffix", DRIVERS)
@pytest.mark.filterwarnings("ignore:.*crs.*was not provided")
def test_every_format(tmp_path: Path, scan: Path, suffix: str) -> None:
    kml = suffix == ".kml"
    square = in_system(SQUARE, "OGC:CRS84") if kml else SQUARE
    system = "EPSG:4326" if kml else "EPSG:32632"
    columns: dict[str, Any] = {} if suffix == ".dxf" else {"Name": ["north"]}
    path = saved(tmp_path / f"a{suffix}", shapely.Polygon(square), system=system, **columns)
    report = divespot.measure(scan, outline=path)
    require_the_cone(report)
    assert report.piles[0].name == ("0" if suffix == ".dxf" else "north")
    assert any("reprojected" in warning for warning in report.warnings) == kml


@pytest.mark.parametrize("system", ["EPSG:25833", "EPSG:3857", "EPSG:4326"])
def test_another_system_is_reprojected(tmp_path: Path, scan: Path, system: str) -> None:
    lines = in_system(SQUARE, "OGC:CRS84" if system == "EPSG:4326" else system)
    path = saved(tmp_path / "a.gpkg", shapely.Polygon(lines), system=system)
    report = divespot.measure(scan, outline=path)
    require_the_cone(report)
    assert any("outlines were reprojected from" in warning for warning in report.warnings)


def geojson(folder: Path, lines: NDArray[np.float64], system: str | None = None) -> str:
    content: dict[str, Any] = {"type": "Polygon", "coordinates": [lines.tolist()]}
    if system:
        content["crs"] = {"type": "name", "properties": {"name": system}}
    path = folder / "a.geojson"
    path.write_text(json.dumps(content))
    return str(path)


def test_geojson_in_degrees_is_wgs_84(tmp_path: Path, scan: Path) -> None:
    path = geojson(tmp_path, in_system(SQUARE, "OGC:CRS84"))
    report = divespot.measure(scan, outline=path)
    require_the_cone(report)
    assert [w for w in report.warnings if "reprojected from WGS 84" in w]


def test_geojson_that_names_its_system(tmp_path: Path, scan: Path) -> None:
    lines = in_system(SQUARE, "EPSG:25833")
    path = geojson(tmp_path, lines, "urn:ogc:def:crs:EPSG::25833")
    require_the_cone(divespot.measure(scan, outline=path))
    same = geojson(tmp_path, SQUARE, "urn:ogc:def:crs:EPSG::32632")
    require_the_cone(divespot.measure(scan, outline=same))


def test_degrees_over_a_scan_without_a_system_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DivespotError, match="a scan that states its system"):
        divespot.measure(CONE + AT, outline=geojson(tmp_path, in_system(SQUARE, "OGC:CRS84")))


def test_closed_lines_are_areas_and_points_are_none(tmp_path: Path, scan: Path) -> None:
    shapes = [shapely.LineString(SQUARE), shapely.Point(AT[:2]), shapely.LineString(SQUARE[:2])]
    path = saved(tmp_path / "a.gpkg", *shapes)
    report = divespot.measure(scan, outline=path)
    require_the_cone(report)
    assert any("2 features that are no areas" in warning for warning in report.warnings)


def halves() -> list[Any]:
    (x, y), h = AT[:2], 0.75
    return [shapely.box(x - h, y - h, x, y + h), shapely.box(x, y - h, x + h, y + h)]


def test_names_and_materials(tmp_path: Path, scan: Path) -> None:
    materials = ["wheat", "Crushed Stone"]
    path = saved(tmp_path / "a.gpkg", *halves(), LABEL=["west", "east"], Material=materials)
    report = divespot.measure(scan, outline=path)
    found = {str(pile.name): pile for pile in report.piles}
    assert set(found) == {"west", "east"}
    for name, material in (("west", "wheat"), ("east", "crushed-stone")):
        density = MATERIALS[material].density_kg_m3
        assert found[name].material == material
        assert found[name].mass_kg == pytest.approx(density * found[name].volume_m3)
    masses = [pile.mass_kg or 0.0 for pile in report.piles]
    assert report.total.mass_kg == pytest.approx(sum(masses))
    u95 = [pile.u95_mass_kg or 0.0 for pile in report.piles]
    assert np.linalg.norm(u95) <= (report.total.u95_mass_kg or 0.0) * (1 + 1e-9)
    assert (report.total.u95_mass_kg or 0.0) <= sum(u95)


def test_a_density_that_is_given_goes_before_the_material(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", *halves(), material=["wheat", "rye"])
    report = divespot.measure(scan, outline=path, density_kg_m3=1000.0)
    assert report.total.mass_kg == pytest.approx(1000.0 * report.total.volume_m3)


def test_a_material_that_is_not_known_has_no_mass(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", *halves(), material=["wheat", "gravel 16/32"])
    report = divespot.measure(scan, outline=path, material="corn")
    assert [pile.mass_kg is None for pile in report.piles].count(True) == 1
    assert report.total.mass_kg is None
    assert any("density of 'gravel-16/32' is not known" in w for w in report.warnings)


def test_results_tell_each_pile_s_material(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", *halves(), material=["wheat", "crushed stone"])
    report = divespot.measure(scan, outline=path, material="corn")
    materials = [pile.material for pile in report.piles]
    assert set(materials) == {"wheat", "crushed-stone"}
    assert [row["material"] for row in rows_of(report)] == materials
    told = [feature["properties"]["material"] for feature in collection(report)["features"]]
    assert told == materials
    shown = Shown.of(report, "t")
    for pile in report.piles:
        assert shown.per_m3_of(pile) * pile.volume_m3 == pytest.approx((pile.mass_kg or 0) / 1e3)
    assert "mass t" in next(report_table(report, "t").lines(120))


def test_a_mass_that_is_not_known_is_told_as_none(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", *halves(), material=["wheat", "gravel 16/32"])
    report = divespot.measure(scan, outline=path)
    cells = [cell.text for cell in Document.of(report, Survey(), 1).piles.total]
    assert "-" in cells
    assert "0 ± " not in "".join(report_table(report).lines(120))
    with pytest.raises(DivespotError, match="without a density: --material or --density is needed"):
        Shown.of(report, "t")


def test_one_material_weighs_as_it_does_without_outlines(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", *halves(), material=["wheat", "wheat"])
    by_outline = divespot.measure(scan, outline=path)
    by_option = divespot.measure(
        scan, outline=saved(tmp_path / "b.gpkg", *halves()), material="wheat"
    )
    assert by_outline.total == by_option.total


def broken(folder: Path, suffix: str) -> Path:
    path = folder / f"a{suffix}"
    saved(path, shapely.Polygon(SQUARE))
    return path


@pytest.mark.parametrize("suffix", [".gpkg", ".shp", ".fgb"])
def test_damaged_files(tmp_path: Path, scan: Path, suffix: str) -> None:
    path = broken(tmp_path, suffix)
    data = path.read_bytes()
    for size in (0, 10, 90):
        path.write_bytes(data[:size])
        with pytest.raises(DivespotError, match=f"a{suffix}: ") as caught:
            divespot.measure(scan, outline=str(path))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "words"), [("none.gpkg", "cannot be read"), ("folder.gpkg", "is a folder")]
)
def test_what_is_no_file(tmp_path: Path, scan: Path, name: str, words: str) -> None:
    (tmp_path / "folder.gpkg").mkdir()
    with pytest.raises(DivespotError, match=words):
        divespot.measure(scan, outline=str(tmp_path / name))


def test_files_without_areas(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", shapely.Point(AT[:2]))
    with pytest.raises(DivespotError, match="holds no area"):
        divespot.measure(scan, outline=path)


def test_an_outline_off_the_map(tmp_path: Path, scan: Path) -> None:
    path = saved(tmp_path / "a.gpkg", shapely.box(100.0, 91.0, 101.0, 92.0), system="EPSG:4326")
    with pytest.raises(DivespotError, match=r"does not lie where|inside|outline"):
        divespot.measure(scan, outline=path)


def test_without_pyogrio_it_is_said(
    tmp_path: Path, scan: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = saved(tmp_path / "a.gpkg", shapely.Polygon(SQUARE))
    monkeypatch.setitem(__import__("sys").modules, "pyogrio", None)
    with pytest.raises(DivespotError, match=r"pip install divespot\[gis\]"):
        divespot.measure(scan, outline=path)
