"""The reference system of a scan whose file states none."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import DivespotError
from divespot import io as dio
from divespot.io.systems import known_system, reprojected
from io_samples import las
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

pytest.importorskip("pyproj", reason="the extra crs is not installed")

CONE = sampled(SOLIDS["cone"], 2.0**-6, (1.25, 1.125))
AT = np.array([500_000.0, 5_391_000.0, 120.0])
K = 0.9996


def saved(folder: Path, points: NDArray[np.float64]) -> Path:
    path = folder / "a.npy"
    np.save(path, points)
    return path


def test_a_system_that_is_given_scales_and_places(tmp_path: Path) -> None:
    points = CONE * (K, K, 1.0) + AT
    plain = divespot.measure(CONE + AT).total.volume_m3
    path = saved(tmp_path, points)
    report = divespot.measure(path, crs="EPSG:32632")
    assert report.total.volume_m3 == pytest.approx(plain, rel=2e-5)
    assert (report.source.crs, report.ground.up_from) == ("EPSG:32632", "coordinate system")
    assert not any("unit" in warning for warning in report.warnings)
    half = 0.75 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1.0]])
    source, target = known_system("EPSG:32632"), known_system("OGC:CRS84")
    lines = reprojected(AT[:2] + half, source, target)
    outline = tmp_path / "a.geojson"
    outline.write_text(json.dumps({"type": "Polygon", "coordinates": [lines.tolist()]}))
    inside = divespot.measure(path, crs="EPSG:32632", outline=str(outline))
    assert inside.total.volume_m3 == pytest.approx(plain, rel=2e-3)
    assert divespot.measure(points, crs="EPSG:32632").total == report.total


def test_units_follow_from_it(tmp_path: Path) -> None:
    scan = dio.read(saved(tmp_path, CONE), crs="EPSG:2992")
    assert (scan.unit, scan.unit_stated, scan.projected) == ("ft", True, True)
    with pytest.raises(DivespotError, match="degrees"):
        dio.read(saved(tmp_path, CONE), crs="EPSG:4326")
    scan = dio.read(saved(tmp_path, CONE), crs="EPSG:32610+6360")
    np.testing.assert_allclose(scan.points[:, 2], CONE[:, 2] * 1200 / 3937)


def test_what_the_file_states_goes_before(tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    path.write_bytes(las(CONE + AT, geokeys={1024: 1, 3072: 32632, 3076: 9001}))
    scan = dio.read(path, crs="EPSG:32633")
    assert scan.crs == "EPSG:32632"
    assert any("states its own reference system" in warning for warning in scan.warnings)
    assert dio.read(path, crs="EPSG:32632").warnings == dio.read(path).warnings


@pytest.mark.parametrize("crs", ["", "UTM 32", "EPSG:1", "EPSG:", "PROJCS[", "+proj=utm"])
def test_what_is_no_system(tmp_path: Path, crs: str) -> None:
    for source in (saved(tmp_path, CONE), CONE):
        with pytest.raises(DivespotError, match=r"EPSG:CODE or WKT is needed"):
            divespot.measure(source, crs=crs)
    with pytest.raises(DivespotError, match="crs is 3"):
        divespot.Settings(crs=3)  # type: ignore[arg-type]


def test_without_pyproj_it_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyproj", None)
    with pytest.raises(DivespotError, match=r"pip install divespot\[crs\]"):
        divespot.measure(saved(tmp_path, CONE), crs="EPSG:32632")
