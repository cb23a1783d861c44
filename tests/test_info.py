"""``divespot info``: what it says of small and large scans, and of files that are none."""

from __future__ import annotations

import json
import struct
import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError
from divespot.cli import main
from divespot.io import las_sample
from io_samples import UTM, VALID_LAS, las
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

STEP_M = 2.0**-6
CONE = sampled(SOLIDS["cone"], STEP_M, (1.25, 1.125))
UTM32 = {1024: 1, 3072: 32632, 3076: 9001}


def test_what_is_told_of_a_survey(tmp_path: Path) -> None:
    path = tmp_path / "a.laz"
    path.write_bytes(las(CONE + UTM, compress=True, scale=1e-4, geokeys=UTM32))
    found = divespot.info(path)
    assert (found.format, found.points, found.looked_at) == ("LAS/LAZ", len(CONE), len(CONE))
    np.testing.assert_allclose(found.low, CONE.min(axis=0) + UTM, atol=1e-4)
    np.testing.assert_allclose(found.high, CONE.max(axis=0) + UTM, atol=1e-4)
    assert found.spacing_m == pytest.approx(STEP_M, rel=0.02)
    assert found.density_per_m2 == pytest.approx(STEP_M**-2, rel=0.04)
    assert (found.unit, found.unit_stated, found.crs) == ("m", True, "EPSG:32632")
    assert (found.classes, found.projected) == ({0: len(CONE)}, True)
    assert found.ground is not None
    assert (found.ground.up_from, found.ground.normal) == ("coordinate system", (0.0, 0.0, 1.0))
    assert found.size_bytes == path.stat().st_size


def test_what_is_told_of_a_frame(tmp_path: Path) -> None:
    points = CONE.copy()
    points[:7], points[7:12] = 0.0, np.nan
    path = tmp_path / "a.npy"
    np.save(path, 1e3 * points)
    found = divespot.info(path, unit="mm", up="z")
    assert (found.dropped_nonfinite, found.dropped_zero) == (5, 7)
    np.testing.assert_allclose(found.high, 1e3 * CONE.max(axis=0), rtol=1e-12)
    assert found.ground is not None
    assert found.ground.up_from == "given"
    assert found.ground.normal[2] == pytest.approx(1.0, abs=1e-6)
    assert found.classes == {}


def test_where_no_ground_is_found_the_rest_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    directions = np.random.default_rng(0).normal(size=(5000, 3))
    np.save(path, directions / np.linalg.norm(directions, axis=1, keepdims=True))
    found = divespot.info(path)
    assert found.points == 5000
    assert found.ground is None
    assert any("up cannot be told" in warning for warning in found.warnings)


@pytest.mark.parametrize("compress", [False, True])
def test_of_a_large_file_stretches_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, compress: bool
) -> None:
    monkeypatch.setattr(las_sample, "MOST", 10_000)
    monkeypatch.setattr(las_sample, "STRETCH", 100)
    x, y = np.meshgrid(np.arange(500) * 0.1, np.arange(400) * 0.1)
    points = np.column_stack([x.ravel(), y.ravel(), 0.01 * x.ravel()]) + UTM
    path = tmp_path / "a.laz"
    path.write_bytes(las(points, compress=compress, geokeys=UTM32))
    found = divespot.info(path)
    assert (found.points, found.looked_at) == (200_000, 4_000)
    np.testing.assert_allclose(found.high, points.max(axis=0), atol=1e-3)
    # Of whole lines, every hundred of them far apart, the step is what can be told.
    assert 0.05 < found.spacing_m < 0.4
    assert found.classes == {0: 4_000}
    shown = CliRunner().invoke(main, ["info", str(path)]).stdout
    assert "200,000, 4,000 of them looked at" in shown


def test_a_large_file_takes_little_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(las_sample, "MOST", 10_000)
    monkeypatch.setattr(las_sample, "STRETCH", 100)
    path = tmp_path / "a.las"
    path.write_bytes(las(np.random.default_rng(0).random((500_000, 3))))
    tracemalloc.start()
    divespot.info(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < path.stat().st_size / 2


def test_json(tmp_path: Path) -> None:
    path, out = tmp_path / "a.laz", tmp_path / "a.json"
    path.write_bytes(las(CONE + UTM, compress=True, geokeys=UTM32))
    result = CliRunner().invoke(main, ["info", str(path), "--json", "-"])
    assert result.exit_code == 0
    found = json.loads(result.stdout)
    assert found["schema"] == "divespot.info/1"
    assert found["classes"] == {"0": len(CONE)}
    again = CliRunner().invoke(main, ["info", str(path), "--json", str(out)])
    assert "points" in again.stdout
    assert json.loads(out.read_text()) == found
    over = CliRunner().invoke(main, ["info", str(path), "--json", str(path), "--force"])
    assert over.exit_code == 1


def cut(data: bytes) -> bytes:
    return data[:-20]


def promising(data: bytes) -> bytes:
    lie = bytearray(data)
    struct.pack_into("<Q", lie, 247, 4_000_000_000)
    return bytes(lie)


@pytest.mark.parametrize("change", [cut, promising])
@pytest.mark.parametrize("name", ["cloud.las", "layered.laz"])
def test_damaged_files(tmp_path: Path, name: str, change: Callable[[bytes], bytes]) -> None:
    if change is promising and name == "cloud.las":
        pytest.skip("LAS 1.2 has its count elsewhere")
    path = tmp_path / name
    path.write_bytes(change(VALID_LAS[name]))
    result = CliRunner().invoke(main, ["info", str(path)])
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
    assert str(path) in result.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [({"unit": "furlong"}, "unit is 'furlong'"), ({"up": "sideways"}, "up is 'sideways'")],
)
def test_options_out_of_range(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    path = tmp_path / "a.npy"
    np.save(path, CONE)
    with pytest.raises(DivespotError, match=words):
        divespot.info(path, **options)


def test_a_scan_of_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    path.write_text("0 0 0\n" * 20)
    with pytest.raises(DivespotError, match=r"20 are \(0, 0, 0\)"):
        divespot.info(path)


def test_no_such_file() -> None:
    result = CliRunner().invoke(main, ["info", "nowhere.laz"])
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)
