"""Surface models as rasters: GeoTIFF and Erdas Imagine, through rasterio (the extra ``raster``)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.extras import extra
from divespot.io.crs import Crs, crs_from_wkt
from divespot.io.grid_points import points_of_grid
from divespot.io.packed import require_size
from divespot.io.scan import FloatArray, RawCloud
from divespot.io.units import unit_named

if TYPE_CHECKING:
    from collections.abc import Callable

    from divespot.io.wanted import Rectangle, Wanted

    Span = tuple[int, int]


#: Of rasters with more cells, those outside the wanted rectangle are not unpacked.
MANY_CELLS = 2**23


def reader(driver: str) -> Callable[[bytes, Wanted], RawCloud]:
    """Return what reads the rasters of one of GDAL's drivers, and never those of another."""

    def read(data: bytes, wanted: Wanted) -> RawCloud:
        rasterio = extra("rasterio", "raster", "a raster of heights needs rasterio")
        try:
            with rasterio.MemoryFile(data) as memory, memory.open(driver=driver) as source:
                return _cells(source, len(data), wanted)
        except (DivespotError, MemoryError):
            raise
        # rasterio passes on a dozen kinds of GDAL's exceptions.
        except Exception as err:  # noqa: BLE001
            raise damaged(f"not a readable raster ({err})") from None

    return read


def _cells(source: Any, size: int, wanted: Wanted) -> RawCloud:  # noqa: ANN401 - rasterio ships no types
    """Return the middle of each cell; a cell without data has no height."""
    kind = np.dtype(source.dtypes[0])
    if kind.kind not in "iuf" or kind.itemsize == 1:
        raise DivespotError(
            f"it holds {source.count} bands of {kind}, a picture: heights are needed"
        )
    require_size(source.width * source.height * kind.itemsize, size)
    if source.transform.is_identity:
        raise DivespotError("it does not say where its cells lie: a georeferenced raster is needed")
    crs = crs_from_wkt(source.crs.to_wkt()) if source.crs else Crs()
    plan = wanted.rectangle(crs.text, source.bounds[:2], source.bounds[2:])
    columns, rows = _window(source, plan)
    heights, first = _heights(source, columns, rows), (columns[0], rows[0])
    xyz = points_of_grid(heights, tuple(source.transform)[:6], first)
    told = (f"of its {source.count} bands the first was taken as heights",)
    return RawCloud(
        *(xyz, crs.unit, unit_named(source.units[0] or "") or crs.vertical_unit, crs.text),
        warnings=(*crs.warnings, *(told if source.count > 1 else ())),
        projected=True,
    )


def _window(source: Any, plan: Rectangle | None) -> tuple[Span, Span]:  # noqa: ANN401
    """Return the columns and rows of a large raster that meet a rectangle; of a small one, all."""
    whole = (0, source.width), (0, source.height)
    if plan is None or source.width * source.height <= MANY_CELLS:
        return whole
    corners = [~source.transform * (x, y) for x in plan[::2] for y in plan[1::2]]
    ends = np.clip(np.array(corners), (0, 0), (source.width, source.height))
    low, high = np.floor(ends.min(axis=0)), np.ceil(ends.max(axis=0))
    if not (low < high).all():
        return whole
    return (int(low[0]), int(high[0])), (int(low[1]), int(high[1]))


def _heights(source: Any, columns: Span, rows: Span) -> FloatArray:  # noqa: ANN401
    band = source.read(1, masked=True, window=(rows, columns))
    scale, offset = float(source.scales[0]), float(source.offsets[0])
    heights: FloatArray = band.astype(np.float64).filled(np.nan)
    return heights * scale + offset
