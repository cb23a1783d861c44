"""The scale of a projection: told, and corrected where lengths are off by more than 100 ppm."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import io as dio
from divespot.io.systems import is_same_system, known_system, scale_factor
from io_samples import las
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

pytest.importorskip("pyproj", reason="the extra crs is not installed")

CONE = sampled(SOLIDS["cone"], 2.0**-6, (1.25, 1.125))
K = 0.9996
"""The scale of UTM on its central meridian."""
MIDDLE = np.array([500_000.0, 5_391_000.0, 120.0])
# There the scale of UTM is 1 to some ppm.
ASIDE = np.array([680_400.0, 5_391_000.0, 120.0])
UTM32 = {1024: 1, 3072: 32632, 3076: 9001}


def survey(
    folder: Path, at: NDArray[np.float64] = MIDDLE, scale: float = K, name: str = "a.las"
) -> Path:
    path = folder / name
    path.write_bytes(las(CONE * (scale, scale, 1.0) + at, scale=1e-5, geokeys=UTM32))
    return path


def plain(folder: Path) -> float:
    """Return the volume of the same points without a reference system."""
    path = folder / "plain.npy"
    np.save(path, CONE + MIDDLE)
    return divespot.measure(path).total.volume_m3


def test_utm_on_its_meridian_is_corrected(tmp_path: Path) -> None:
    report = divespot.measure(survey(tmp_path))
    assert report.source.scale_factor == pytest.approx(K, abs=1e-8)
    assert report.total.volume_m3 == pytest.approx(plain(tmp_path), rel=2e-5)
    (told,) = (warning for warning in report.warnings if "projection" in warning)
    assert "-400 ppm" in told
    assert "+0.08 %" in told


def test_positions_stay_those_of_the_map(tmp_path: Path) -> None:
    report = divespot.measure(survey(tmp_path))
    (pile,) = report.piles
    np.testing.assert_allclose(pile.centroid_m[:2], MIDDLE[:2], atol=2e-3)
    path = tmp_path / "lines.geojson"
    divespot.save_outlines(report, path)
    inside = divespot.measure(survey(tmp_path), outline=str(path))
    assert inside.total.volume_m3 == pytest.approx(report.total.volume_m3, rel=2e-3)


def test_base_and_crop_are_in_the_map(tmp_path: Path) -> None:
    path = survey(tmp_path)
    report = divespot.measure(path)
    base = tmp_path / "base.npy"
    divespot.save_base(report, base)
    again = divespot.measure(path, base=f"surface={base}")
    assert again.total.volume_m3 == pytest.approx(report.total.volume_m3, rel=2e-3)
    x, y, z = MIDDLE
    half = divespot.measure(path, crop=(x - 0.9, y - 0.9, z - 9, x + 0.9, y + 0.9, z + 9))
    assert half.total.volume_m3 == pytest.approx(report.total.volume_m3, rel=2e-3)


def test_less_than_100_ppm_is_told_but_left(tmp_path: Path) -> None:
    report = divespot.measure(survey(tmp_path, ASIDE, 1.0))
    factor = report.source.scale_factor
    assert factor is not None
    assert 0 < abs(factor - 1.0) < 1e-4
    assert not any("projection" in warning for warning in report.warnings)
    assert report.total.volume_m3 == pytest.approx(plain(tmp_path), rel=2e-5)


def test_info_tells_it_too(tmp_path: Path) -> None:
    found = divespot.info(survey(tmp_path))
    assert found.scale_factor == pytest.approx(K, abs=1e-8)
    np.testing.assert_allclose(found.high, CONE.max(axis=0) * (K, K, 1) + MIDDLE, atol=1e-4)


def test_without_pyproj_it_is_not_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyproj", None)
    report = divespot.measure(survey(tmp_path))
    assert report.source.scale_factor is None
    assert any("pip install divespot[crs]" in warning for warning in report.warnings)
    assert report.total.volume_m3 == pytest.approx(K**2 * plain(tmp_path), rel=2e-5)


@pytest.mark.parametrize(
    ("system", "place", "scale"),
    [
        # Oregon Lambert in feet: as PROJ has it.
        ("EPSG:2992", (636_001.0, 848_935.0), 0.99976918),
        ("EPSG:25832+7837", (500_000.0, 5.4e6), K),
        # Web Mercator on the equator: 1 across, 1 / (1 - e²) along the meridian.
        ("EPSG:3857", (0.0, 0.0), 1.00336),
    ],
)
def test_scales(system: str, place: tuple[float, float], scale: float) -> None:
    assert scale_factor(system, np.array(place)) == pytest.approx(scale, rel=1e-5)


@pytest.mark.parametrize("system", [None, "", "EPSG:4326", "EPSG:1", "UTM 32", "PROJCS[", "[]"])
def test_what_has_no_scale(system: str | None) -> None:
    assert scale_factor(system, np.array([500_000.0, 5.4e6])) is None


def test_a_place_off_the_map_has_no_scale() -> None:
    assert scale_factor("EPSG:32632", np.array([1e12, 5e6])) is None


@pytest.mark.parametrize(
    ("system", "place", "is_used"),
    [
        ("EPSG:32632", (500_000.0, 5_391_000.0), True),
        ("EPSG:32632", (700_000.0, 5_391_000.0), True),  # a degree behind its border at 12 degrees
        ("EPSG:32632", (1_200_000.0, 5_391_000.0), False),
        ("EPSG:2278", (1_640_000.0, 17_700_000.0), False),  # feet in Texas, ten degrees north of it
        ("EPSG:32660", (740_000.0, 5_391_000.0), True),  # across the antimeridian
    ],
)
def test_a_system_has_no_scale_far_from_where_it_is_used(
    system: str, place: tuple[float, float], *, is_used: bool
) -> None:
    assert (scale_factor(system, np.array(place)) is not None) == is_used


def test_systems_are_compared_by_what_they_mean() -> None:
    system = known_system("EPSG:32632")
    assert system is not None
    assert is_same_system("EPSG:32632", system.to_wkt())
    assert not is_same_system("EPSG:32632", "EPSG:32633")
    assert not is_same_system("EPSG:32632", "a name")


def test_feet_of_a_projection_are_corrected_in_feet(tmp_path: Path) -> None:
    at = np.array([636_001.0, 848_935.0, 400.0])
    points = CONE * (0.99976918, 0.99976918, 1.0) / 0.3048 + at
    path = tmp_path / "a.las"
    path.write_bytes(las(points, scale=1e-5, geokeys={1024: 1, 3072: 2992, 3076: 9002}))
    assert dio.read(path).unit == "ft"
    assert divespot.measure(path).total.volume_m3 == pytest.approx(plain(tmp_path), rel=2e-5)
