"""The heights of a report as a GeoTIFF: surface, base, and their difference."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import require_kind
from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.output import other_ending, refuse_inputs, whole
from divespot.report import Report
from divespot.results.drawn_fill import filled
from divespot.results.pile_matching import labels
from divespot.results.plan_frame import PlanFrame

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from divespot.report import Pile
    from divespot.results.plan_frame import Placed

ENDINGS = (".tif", ".tiff")

#: A later run recognizes its own files by this; see `divespot.output.DEM`.
MARK = "written by divespot"

BANDS = ("surface", "base", "difference", "seen")


def save_dem(report: Report, path: str | os.PathLike[str]) -> None:
    """Write surface, base, difference and seen cells, in the scan's own frame and unit.

    The cells are those that were measured, so that the difference summed over a pile is its volume.
    If the level frame is rotated against the scan's x and y, so is the raster (by its affine
    transform). Cells within piles that were not seen (0 in the last band) are interpolated; other
    unseen cells are NaN.

    Raises
    ------
    DivespotError
        The ending is unknown, the extra ``raster`` is missing, the scan's x and y are not plan
        coordinates of its ground, or the file cannot be written.

    """
    require_kind("report", report, Report)
    save_heights(report, path, BANDS, report.inputs, report.piles)


def save_heights(
    report: Placed,
    path: str | os.PathLike[str],
    bands: tuple[str, ...],
    inputs: Iterable[str | None],
    piles: Sequence[Pile] = (),
) -> None:
    """Write heights, base, difference and seen cells (see `save_dem`)."""
    if not str(path).lower().endswith(ENDINGS):
        raise other_ending(path, "heights", ENDINGS)
    refuse_inputs(path, "the heights", inputs)
    frame = PlanFrame.of(report)
    if not frame.is_scan:
        raise DivespotError(
            f"{path}: the scan's z is not up: x and y as its plan are needed for a raster"
        )
    data = _written(report, frame, bands, _bands(report, piles))
    with whole(path) as stream:
        stream.write(data)


def _written(
    report: Placed, frame: PlanFrame, names: tuple[str, ...], bands: NDArray[np.float32]
) -> bytes:
    need = "a raster of heights needs rasterio"
    rasterio = extra("rasterio", "raster", need)
    memory = extra("rasterio.io", "raster", need).MemoryFile()
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
            raster.units = (*(frame.unit,) * 3, "1")
            raster.update_tags(TIFFTAG_SOFTWARE=MARK, AREA_OR_POINT="Area")
        return bytes(memory.read())


def _bands(report: Placed, piles: Sequence[Pile]) -> NDArray[np.float32]:
    """Return the bands, northernmost row first."""
    level = report.level
    x, y = level.height_map.centers_m()
    seen = ~np.isnan(level.height_map.heights_m)
    within = labels(piles, level.frame, level) > 0
    surface = _through(level.height_map.heights_m, within)
    base = _through(level.base_m, within)
    above = [
        level.frame.to_scan(np.stack([x, y, heights], axis=-1))[..., 2]
        for heights in (surface, base)
    ]
    difference = (surface - base) / level.frame.metres
    return np.stack([*above, difference, seen])[:, ::-1].astype(np.float32)


def _through(heights_m: NDArray[np.float64], within: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return heights interpolated across gaps within piles."""
    return np.where(np.isnan(heights_m) & within, filled(heights_m), heights_m)


def _transform(frame: PlanFrame, rows: int) -> Any:  # noqa: ANN401 - of a package that may be absent
    """Return the transform from columns and rows, counted from the upper left, to x and y."""
    (a, c, e), (b, d, f) = frame.matrix
    affine = extra("affine", "raster", "a raster of heights needs rasterio").Affine
    return affine(a, -c, e + rows * c, b, -d, f + rows * d)


def _system(report: Placed) -> Any:  # noqa: ANN401 - as above
    """Return the scan's coordinate system; None if GDAL does not know it."""
    crs = extra("rasterio.crs", "raster", "a raster of heights needs rasterio").CRS
    if not report.source.crs:
        return None
    try:
        return crs.from_user_input(report.source.crs)
    except ValueError:  # rasterio's CRSError is a subclass
        return None
