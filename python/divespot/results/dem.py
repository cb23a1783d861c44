"""The heights of a report as a GeoTIFF: surface, base, and the difference of the two."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import require_kind
from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.output import refuse_inputs, whole
from divespot.report import Report
from divespot.results.plan_frame import PlanFrame

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from divespot.results.plan_frame import Placed

ENDINGS = (".tif", ".tiff")

#: By this a later run knows its own files; see `divespot.output.DEM`.
MARK = "written by divespot"

BANDS = ("surface", "base", "difference")


def save_dem(report: Report, path: str | os.PathLike[str]) -> None:
    """Write three bands: surface, base and difference, in the scan's own frame and unit.

    The cells are those that were measured, so that the difference summed up over a pile is its
    volume; where the level frame is turned against the scan's x and y, so is the raster (by its
    affine transform). NaN where nothing was seen.

    Raises
    ------
    DivespotError
        Another ending, the extra ``raster`` is not installed, the scan's x and y are no plan of
        its ground, or the file cannot be written.

    """
    require_kind("report", report, Report)
    save_heights(report, path, BANDS, report.inputs)


def save_heights(
    report: Placed,
    path: str | os.PathLike[str],
    bands: tuple[str, str, str],
    inputs: Iterable[str | None],
) -> None:
    """Write heights, those of the base, and their difference under these names (see `save_dem`)."""
    if not str(path).lower().endswith(ENDINGS):
        raise DivespotError(f"{path}: heights are written as one of {', '.join(ENDINGS)}")
    refuse_inputs(path, "the heights", inputs)
    frame = PlanFrame.of(report)
    if not frame.is_scan:
        raise DivespotError(f"{path}: x and y of the scan are no plan of its ground: no raster")
    data = _written(report, frame, bands)
    with whole(path) as stream:
        stream.write(data)


def _written(report: Placed, frame: PlanFrame, names: tuple[str, str, str]) -> bytes:
    need = "a raster of heights needs rasterio"
    rasterio = extra("rasterio", "raster", need)
    memory = extra("rasterio.io", "raster", need).MemoryFile()
    bands = _bands(report)
    _, rows, columns = bands.shape
    look: dict[str, Any] = {"compress": "deflate", "predictor": 3, "nodata": float("nan")}
    with memory, rasterio.Env(GDAL_PAM_ENABLED="NO"):
        with memory.open(
            driver="GTiff",
            count=len(names),
            height=rows,
            width=columns,
            dtype="float32",
            transform=_transform(frame, rows),
            crs=_system(report),
            **look,
        ) as raster:
            raster.write(bands)
            raster.descriptions = names
            raster.units = (frame.unit,) * len(names)
            raster.update_tags(TIFFTAG_SOFTWARE=MARK, AREA_OR_POINT="Area")
        return bytes(memory.read())


def _bands(report: Placed) -> NDArray[np.float32]:
    """Return the bands, the northernmost row first."""
    level = report.level
    x, y = level.height_map.centers_m()
    above = [
        level.frame.to_scan(np.stack([x, y, heights], axis=-1))[..., 2]
        for heights in (level.height_map.heights_m, level.base_m)
    ]
    difference = (level.height_map.heights_m - level.base_m) / level.frame.metres
    return np.stack([*above, difference])[:, ::-1].astype(np.float32)


def _transform(frame: PlanFrame, rows: int) -> Any:  # noqa: ANN401 - of a package that may be absent
    """Return the way from columns and rows, counted from the upper left, to x and y."""
    (a, c, e), (b, d, f) = frame.matrix
    affine = extra("affine", "raster", "a raster of heights needs rasterio").Affine
    return affine(a, -c, e + rows * c, b, -d, f + rows * d)


def _system(report: Placed) -> Any:  # noqa: ANN401 - as above
    """Return the scan's coordinate system; None where it has none that GDAL knows."""
    crs = extra("rasterio.crs", "raster", "a raster of heights needs rasterio").CRS
    if not report.source.crs:
        return None
    try:
        return crs.from_user_input(report.source.crs)
    except ValueError:  # rasterio's CRSError is one
        return None
