"""Surface models as rasters: GeoTIFF, IMG and ESRI grids, as scan and as base."""

from __future__ import annotations

import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import DivespotError
from divespot import io as dio
from io_samples import UTM, read, refused
from solids import SOLIDS

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CELL_M = 2.0**-5
CONE = SOLIDS["cone"]
VOLUME_M3 = CONE.volume_m3
NOTHING = -9999.0


def surface(cell_m: float = CELL_M, size: int = 80) -> NDArray[np.float64]:
    """Return the cone's heights, north first, in the middle of cells about the origin."""
    middle = np.arange(size, dtype=np.float64) * cell_m + (1 - size) * cell_m / 2
    return np.asarray(CONE.height_m(middle[None, :], -middle[:, None]), np.float64)


def esri(heights: NDArray[np.float64], *, corner: tuple[float, float] = (0.0, 0.0)) -> bytes:
    rows, columns = heights.shape
    head = f"ncols {columns}\nnrows {rows}\nxllcorner {corner[0]}\nyllcorner {corner[1]}\n"
    head += f"cellsize {CELL_M}\nNODATA_value {NOTHING:g}\n"
    return (head + "\n".join(" ".join(map(repr, row)) for row in heights.tolist())).encode()


def tiff(path: Path, heights: NDArray[Any], **changes: Any) -> Path:  # noqa: ANN401 - what rasterio takes
    rasterio = pytest.importorskip("rasterio", reason="the extra raster is not installed")
    bands = heights[None] if heights.ndim == 2 else heights
    west, north = UTM[0], UTM[1]
    how: dict[str, Any] = {
        "driver": "GTiff",
        "height": bands.shape[1],
        "width": bands.shape[2],
        "count": len(bands),
        "dtype": bands.dtype,
        "crs": "EPSG:32632",
        "transform": rasterio.Affine(CELL_M, 0.0, west, 0.0, -CELL_M, north),
        "nodata": NOTHING if bands.dtype.kind == "f" else None,
    }
    unit = changes.pop("unit", None)
    with rasterio.open(path, "w", **{**how, **changes}) as out:
        out.write(bands)
        if unit:
            out.units = [unit] * len(bands)
    return path


# ESRI grids


def test_esri_cells_lie_in_their_middle(tmp_path: Path) -> None:
    heights = np.array([[1.0, 2.5, NOTHING], [4.0, 5.0, 6.0]])
    scan = read(tmp_path, "a.asc", esri(heights, corner=(100.0, 200.0)))
    x, y = 100.0 + CELL_M * np.array([0.5, 1.5, 2.5]), 200.0 + CELL_M * np.array([1.5, 0.5])
    np.testing.assert_array_equal(scan.points[:, 0], [*x, *x])
    np.testing.assert_array_equal(scan.points[:, 1], np.repeat(y, 3))
    np.testing.assert_array_equal(scan.points[:, 2], [1.0, 2.5, np.nan, 4.0, 5.0, 6.0])
    assert (scan.projected, scan.format) == (True, "ESRI grid")


def test_an_esri_grid_may_count_from_the_middle_of_cells(tmp_path: Path) -> None:
    data = esri(np.ones((2, 2))).replace(b"llcorner", b"llcenter").replace(b"\n", b"\r\n")
    np.testing.assert_array_equal(read(tmp_path, "a.asc", data).points[2], [0.0, 0.0, 1.0])


def test_a_cone_as_an_esri_grid(tmp_path: Path) -> None:
    path = tmp_path / "a.asc"
    heights = surface()
    heights[:3] = NOTHING
    path.write_bytes(esri(heights, corner=(432_000.0, 5_391_000.0)))
    report = divespot.measure(path)
    assert report.total.volume_m3 == pytest.approx(VOLUME_M3, rel=5e-3)
    assert report.source.dropped_nonfinite == 3 * 80
    assert report.ground.up_from == "coordinate system"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (esri(np.ones((3, 3)))[:-5], "3 rows of 3 heights but"),
        (esri(np.ones((3, 3))).replace(b"ncols 3", b"ncols 3000000000"), "3000000000 heights"),
        (esri(np.ones((3, 3))).replace(b"ncols 3", b"ncols -3"), "-3 heights"),
        (esri(np.ones((3, 3))).replace(b"cellsize", b"dx"), "header lacks a number: ncols"),
        (esri(np.ones((3, 3))).replace(b"0.03125", b"0"), "no area"),
        (esri(np.ones((3, 3))).replace(b"0.03125", b"inf"), "no area"),
        (esri(np.ones((3, 3))).replace(b"1.0 1.0", b"1.0 1-0", 1), "is no number"),
        (b"ncols", "no line has three numbers"),
    ],
)
def test_bad_esri_grids(tmp_path: Path, data: bytes, words: str) -> None:
    assert words in refused(tmp_path, "a.asc", data)


# GeoTIFF


def test_a_cone_as_geotiff(tmp_path: Path) -> None:
    heights = surface()
    heights[:3] = NOTHING
    path = tiff(tmp_path / "a.tif", heights.astype(np.float32))
    scan = dio.read(path)
    np.testing.assert_allclose(scan.points[0, :2], UTM[:2] + CELL_M * np.array([0.5, -0.5]))
    assert (scan.unit, scan.unit_stated, scan.projected) == ("m", True, True)
    assert "UTM zone 32N" in str(scan.crs)
    report = divespot.measure(path)
    assert report.total.volume_m3 == pytest.approx(VOLUME_M3, rel=5e-3)
    assert report.source.dropped_nonfinite == 3 * 80


def test_a_raster_of_the_floor_is_a_base(tmp_path: Path) -> None:
    floor = tiff(tmp_path / "floor.tif", np.zeros((80, 80), np.float32))
    path = tiff(tmp_path / "a.tif", surface().astype(np.float32))
    report = divespot.measure(path, base=f"surface={floor}")
    assert report.total.volume_m3 == pytest.approx(VOLUME_M3, rel=5e-3)


def test_heights_in_feet_over_metres(tmp_path: Path) -> None:
    heights = surface().astype(np.float32) / np.float32(0.3048)
    scan = dio.read(tiff(tmp_path / "a.tif", heights, unit="foot"))
    np.testing.assert_allclose(scan.points[:, 2].max(), surface().max(), rtol=1e-6)
    assert scan.unit == "m"


def test_a_turned_raster(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio", reason="the extra raster is not installed")
    turned = rasterio.Affine.translation(*UTM[:2]) @ rasterio.Affine.rotation(30)
    turned = turned @ rasterio.Affine.scale(CELL_M, -CELL_M)
    path = tiff(tmp_path / "a.tif", surface().astype(np.float32), transform=turned)
    assert divespot.measure(path).total.volume_m3 == pytest.approx(VOLUME_M3, rel=5e-3)


def test_whole_numbers_with_a_scale(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio", reason="the extra raster is not installed")
    path = tiff(tmp_path / "a.tif", np.rint(1e3 * surface()).astype(np.int16), nodata=-1)
    with rasterio.open(path, "r+") as out:
        out.scales = [0.001]
    assert divespot.measure(path).total.volume_m3 == pytest.approx(VOLUME_M3, rel=5e-3)


def test_an_erdas_imagine_raster(tmp_path: Path) -> None:
    path = tiff(tmp_path / "a.img", surface().astype(np.float32), driver="HFA")
    assert divespot.measure(path).total.volume_m3 == pytest.approx(VOLUME_M3, rel=5e-3)


def test_further_bands_are_told(tmp_path: Path) -> None:
    bands = np.stack([surface(), np.ones((80, 80))]).astype(np.float32)
    assert "of its 2 bands the first" in dio.read(tiff(tmp_path / "a.tif", bands)).warnings[0]


BAD: list[tuple[Any, dict[str, Any], str]] = [
    (np.ones((3, 9, 9), np.uint8), {}, "3 bands of uint8, a picture"),
    (np.ones((9, 9), np.complex64), {}, "complex64, a picture"),
    (np.ones((9, 9), np.float32), {"crs": "EPSG:4326"}, "degrees"),
    (np.ones((9, 9), np.float32), {"crs": "EPSG:3857"}, "Mercator"),
]


@pytest.mark.parametrize(("heights", "changes", "words"), BAD)
def test_rasters_that_are_no_surface(
    tmp_path: Path, heights: NDArray[Any], changes: dict[str, Any], words: str
) -> None:
    path = tiff(tmp_path / "a.tif", heights, **changes)
    with pytest.raises(DivespotError, match=words):
        dio.read(path)


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_a_raster_without_a_place(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio", reason="the extra raster is not installed")
    path = tiff(
        tmp_path / "a.tif", np.ones((9, 9), np.float32), transform=rasterio.Affine.identity()
    )
    with pytest.raises(DivespotError, match="georeferenced raster is needed"):
        dio.read(path)


def test_a_raster_that_is_cut_off(tmp_path: Path) -> None:
    data = tiff(tmp_path / "a.tif", surface().astype(np.float32)).read_bytes()
    for size in range(8, len(data), 997):
        said = refused(tmp_path, "a.tif", data[:size])
        assert "not a readable raster" in said


def test_a_raster_whose_size_is_a_lie(tmp_path: Path) -> None:
    path = tiff(tmp_path / "a.tif", np.ones((9, 9), np.float32))
    data = bytearray(path.read_bytes())
    for tag in (256, 257):  # width and height, as shorts
        at = data.index(tag.to_bytes(2, "little") + b"\3\0\1\0\0\0")
        data[at + 8 : at + 10] = b"\xff\xff"
    tracemalloc.start()
    refused(tmp_path, "a.tif", bytes(data))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 64 << 20


def test_without_rasterio_it_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rasterio", None)
    assert "pip install divespot[raster]" in refused(tmp_path, "a.tif", b"II*\0" + bytes(100))


@pytest.mark.parametrize("turned", [False, True])
def test_of_a_large_raster_the_window_that_is_wanted_is_read(
    turned: bool,  # noqa: FBT001
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rasterio = pytest.importorskip("rasterio", reason="the extra raster is not installed")
    affine = rasterio.Affine.translation(*UTM[:2]) @ rasterio.Affine.rotation(30 * turned)
    affine = affine @ rasterio.Affine.scale(CELL_M, -CELL_M)
    path = tiff(tmp_path / "dem.tif", surface(), transform=affine)
    whole = dio.read(path).points
    middle = np.median(whole, axis=0)[:2]
    plan = (*(middle - 0.3), *(middle + 0.2))
    assert np.array_equal(dio.read(path, plan=plan).points, whole)
    monkeypatch.setattr("divespot.io.raster.MANY_CELLS", 100)
    some = dio.read(path, plan=plan).points
    inside = ((whole[:, :2] >= plan[:2]) & (whole[:, :2] <= plan[2:])).all(axis=1)
    rows = {tuple(row) for row in some.tolist()}
    assert {tuple(row) for row in whole.tolist()} > rows
    assert rows >= {tuple(row) for row in whole[inside].tolist()}
    assert len(some) < len(whole) / 4
    assert len(dio.read(path, plan=(0, 0, 1, 1)).points) == len(whole)
