"""The unit of a file, stated or doubted because of its numbers."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from divespot import Settings
from divespot import io as dio
from divespot.intake import load
from divespot.io.crs import crs_from_geokeys, crs_from_wkt
from divespot.io.epsg import projected_unit, vertical_unit
from divespot.io.steps import steps
from divespot.io.units import STRETCHED
from io_samples import FINITE, UTM, las, npy, raster, read, refused

if TYPE_CHECKING:
    from pathlib import Path

# Units of reference systems

GEOGCS = 'GEOGCS["NAD83",DATUM["d",SPHEROID["s",6378137,298.2]],UNIT["degree",0.0174532925]]'


def projcs(projection: str, rest: str) -> str:
    return f'PROJCS["somewhere",{GEOGCS},PROJECTION["{projection}"],PARAMETER["a",-93]{rest}]'


@pytest.mark.parametrize(
    ("wkt", "unit", "vertical"),
    [
        (
            projcs("Transverse_Mercator", ',UNIT["metre",1]')
            + ',VERTCS["v",VDATUM["d"],UNIT["Foot_US",0.3048006096012192]]',
            "m",
            "us-ft",
        ),
        (projcs("Lambert_Conformal_Conic_2SP", ',AUTHORITY["EPSG","2278"]'), "us-ft", None),
        (projcs("Hotine_Oblique_Mercator", ',UNIT["Foot_US"]'), "us-ft", None),
        (projcs("Transverse_Mercator", ',UNIT["cubit"]'), "cubit", None),
        (projcs("Mercator_1SP", ',UNIT["metre",1]'), STRETCHED, None),
        (projcs("Mercator_Auxiliary_Sphere", ',UNIT["Meter",1]'), STRETCHED, None),
        ('PROJCRS["p",CONVERSION["c",METHOD["Mercator (variant B)"]]]', STRETCHED, None),
        (projcs("Plate_Carree", ',UNIT["Meter",1]'), STRETCHED, None),
    ],
)
def test_units_in_wkt(wkt: str, unit: str, vertical: str | None) -> None:
    crs = crs_from_wkt(wkt)
    assert (crs.unit, crs.vertical_unit) == (unit, vertical)


@pytest.mark.parametrize(
    ("keys", "unit", "vertical"),
    [
        ({3072: 2278}, "us-ft", None),
        ({3072: 2222}, "ft", None),
        ({3072: 32632}, "m", None),
        ({3072: 32632, 4096: 6360}, "m", "us-ft"),
        ({3072: 32632, 4096: 8228}, "m", "ft"),
        ({3072: 32632, 4096: 5703}, "m", "m"),
        ({3072: 2278, 3076: 9001}, "m", None),
        ({3072: 3857, 3076: 9001}, STRETCHED, None),
        ({3072: 2136}, "units of 0.3047997101815088 m", None),
        ({3072: 32767, 1026: "NAD83 / Texas Central (ftUS)"}, "us-ft", None),
        ({3072: 32767, 3073: "NAD_1983_StatePlane_Ohio_FIPS_3401_Feet"}, "ft", None),
        ({3072: 40_000}, None, None),
    ],
)
def test_units_in_geokeys(keys: dict[int, Any], unit: str | None, vertical: str | None) -> None:
    crs = crs_from_geokeys({1024: 1, **keys})
    assert (crs.unit, crs.vertical_unit) == (unit, vertical)


def test_codes_in_feet_are_those_of_the_register() -> None:
    assert [projected_unit(code) for code in (2155, 2225, 2250, 2251, 32667)] == [
        "us-ft", "us-ft", "us-ft", "ft", "us-ft"
    ]  # fmt: skip
    assert [vertical_unit(code) for code in (5614, 5702, 5703, 6358, 3855)] == [
        "ft", "us-ft", "m", "us-ft", "m"
    ]  # fmt: skip


def test_codes_in_feet_agree_with_pyproj() -> None:
    pyproj = pytest.importorskip("pyproj")
    codes = sorted(int(code) for code in pyproj.get_codes("EPSG", "PROJECTED_CRS"))
    for code in codes[::20]:
        if projected_unit(code) != STRETCHED:
            factor = pyproj.CRS.from_epsg(code).axis_info[0].unit_conversion_factor
            known = dio.UNITS.get(projected_unit(code) or "m", factor)
            assert known == pytest.approx(factor, rel=1e-9), code


def test_a_code_that_came_later_asks_for_pyproj(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyproj", None)
    scan = read(tmp_path, "a.las", las(FINITE, geokeys={1024: 1, 3072: 15_000}))
    assert not scan.unit_stated
    assert any("pip install divespot[crs]" in text for text in scan.warnings)


def test_a_metre_of_web_mercator_is_refused(tmp_path: Path) -> None:
    data = las(FINITE, wkt=projcs("Mercator_1SP", ',UNIT["metre",1]'))
    assert "Mercator" in refused(tmp_path, "a.las", data)
    assert read(tmp_path, "a.las", data, unit="m").unit == "m"


# What numbers tell


@pytest.mark.parametrize("value", [-9999.0, -32767.0, 0.0, -3.4028234663852886e38, 9999.0])
def test_no_data_is_dropped_and_counted(tmp_path: Path, value: float) -> None:
    points = raster(0.5, 60) + UTM
    points[:200, 2] = value
    scan = read(tmp_path, "a.npy", npy(points))
    assert "200 points share the height" in scan.warnings[0]
    assert np.isnan(scan.points[:200]).all()
    np.testing.assert_array_equal(scan.points[200:], points[200:])
    assert load(points, Settings()).source.dropped_nonfinite == 200


def test_a_floor_of_zeros_is_data(tmp_path: Path) -> None:
    points = raster(0.5, 60)
    points[:, 2] = np.where(np.arange(3600) % 60 > 50, 5.0, 0.0)
    assert not np.isnan(read(tmp_path, "a.npy", npy(points)).points).any()


def test_whole_numbers_and_landscapes_earn_a_warning(tmp_path: Path) -> None:
    millimetres = np.round(raster(10, 30)).astype(np.int16)
    assert "--unit mm" in " ".join(read(tmp_path, "a.npy", npy(millimetres)).warnings)
    assert read(tmp_path, "a.npy", npy(millimetres), unit="mm").warnings == ()
    assert "--unit mm" in " ".join(load(millimetres, Settings()).warnings)
    wide = raster(99.5, 60) + 0.25 * np.pi
    assert "m wide" in " ".join(read(tmp_path, "a.npy", npy(wide)).warnings)


def test_rounded_coordinates_are_named(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    points = (rng.uniform(0, 60, (20_000, 3)) + UTM).astype(np.float32)
    scan = read(tmp_path, "a.npy", npy(points))
    assert "y in steps of 0.5 m" in scan.warnings[0]
    assert scan.quantum_m == (2.0**-5, 0.5, 0.0)
    assert "y in steps of 0.5 m" in load(points, Settings()).warnings[0]
    feet = read(tmp_path, "a.npy", npy(points), unit="ft")
    assert feet.quantum_m[1] == 0.5 * 0.3048


@pytest.mark.parametrize("step", [0.5, 0.1, 0.01])
def test_steps_of_text_and_of_rasters(step: float) -> None:
    rng = np.random.default_rng(1)
    points = np.round(rng.uniform(0, 60, (5000, 3)) / step) * step + UTM
    assert steps(points, "m")[0].tolist() == [step] * 3
    grid = raster(step, 50) + UTM
    assert steps(grid, "m")[0][:2].tolist() == [0, 0]
    assert steps(grid, "m")[1] == ()
