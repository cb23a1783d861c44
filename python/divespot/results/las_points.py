"""The scan's points as LAS, classified by ground and pile."""

from __future__ import annotations

import copy
from io import BytesIO
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot._arguments import require_kind
from divespot.errors import DivespotError
from divespot.io import UNITS, read
from divespot.io.files import bytes_of
from divespot.io.las import read_crs
from divespot.io.packed import unpacked
from divespot.io.systems import known_system
from divespot.io.web import is_url
from divespot.narrowing import plan_of
from divespot.output import refuse_inputs, whole
from divespot.report import Report
from divespot.results.pile_matching import labels
from divespot.settings import given

if TYPE_CHECKING:
    import os

    from numpy.typing import NDArray

ENDINGS = (".las", ".laz")

#: Classes of the LAS specification (ASPRS, 1.4 R15, table 17).
GROUND, UNCLASSIFIED = 2, 1

#: Rounding step for coordinates from files that are not LAS, in their own unit.
STEP = 1e-4

#: Number of points that are classified at a time.
BATCH = 1 << 20

_WKT, _MOST_PILES = 2112, 65535


def save_las(report: Report, path: str | os.PathLike[str]) -> None:
    """Write all points of the scan's file, with class 2 for ground and the number of the pile.

    Points within the margin of the base and in no pile are ground; points in piles and all others
    are unclassified. The extra dimension ``pile`` is 0 outside piles, and for objects that stand or
    hang over them. For a LAS or LAZ file everything else is kept: point format, all dimensions,
    coordinate system, and points that were not measured. For other files, and for several merged
    files, only the points are written; for a file on a server, those inside the crop.

    Raises
    ------
    DivespotError
        The report is for an array or from JSON, the ending is unknown, or the file cannot be read
        or written.

    """
    require_kind("report", report, Report)
    ending = PurePath(path).suffix.lower()
    if ending not in ENDINGS:
        raise DivespotError(f"{path}: points are written as one of {', '.join(ENDINGS)}")
    if report.source.path is None:
        raise DivespotError("an array was measured: points can be written of a scan's file alone")
    refuse_inputs(path, "the points", report.inputs)
    kinds = _Kinds(report)
    compress = ending == ".laz"
    is_one_file = not report.source.files and not is_url(report.source.path)
    data = _bytes_of(report.source.path) if is_one_file else b""
    is_las = data.startswith(b"LASF")
    written = (
        _annotated(data, kinds, compress=compress)
        if is_las
        else _converted(kinds, compress=compress)
    )
    with whole(path) as stream:
        stream.write(written)


def _bytes_of(path: str) -> bytes:
    _, data = unpacked(Path(path), bytes_of(Path(path)))
    return data


class _Kinds:
    """Classifies points by their position."""

    def __init__(self, report: Report) -> None:
        self.report = report
        level = report.level
        self._pile = labels(report.piles, level.frame, level)
        self._margin_m = given(report.settings.margin_m)

    def of(self, points_m: NDArray[np.float64]) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
        """Return class and pile of points in the scan's frame, in metres."""
        level, grid = self.report.level, self.report.level.height_map
        at = level.frame.to_level(points_m / level.frame.metres)
        finite = np.asarray(np.isfinite(at).all(axis=1))
        cells = np.floor((np.where(finite[:, None], at, 0.0)[:, :2] - grid.origin_m) / grid.cell_m)
        rows, columns = grid.heights_m.shape
        column, row = cells.T
        inside = finite & (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        cell = np.where(inside, row, 0).astype(int), np.where(inside, column, 0).astype(int)
        surface, base = grid.heights_m[cell], level.base_m[cell]
        # A cell's height is that of its middle: on a slope, its points differ by up to half a cell.
        near = np.abs(at[:, 2] - surface) <= max(self._margin_m, grid.cell_m)
        pile = np.where(inside & near, np.minimum(self._pile[cell], _MOST_PILES), 0)
        on_base = np.abs(at[:, 2] - base) <= self._margin_m
        is_ground = inside & on_base & (self._pile[cell] == 0)
        kinds = np.where(is_ground, GROUND, UNCLASSIFIED)
        return kinds.astype(np.uint8), pile.astype(np.uint16)


def _annotated(data: bytes, kinds: _Kinds, *, compress: bool) -> bytes:
    """Return a copy of a LAS file with its points classified."""
    import laspy  # noqa: PLC0415  (import divespot stays light)

    held = BytesIO()
    with laspy.open(BytesIO(data), laz_backend=laspy.LazBackend.Lazrs) as reader:
        factors = _metres(reader.header, kinds.report)
        header = _header_of(reader.header)
        with laspy.open(held, "w", header=header, do_compress=compress, closefd=False) as writer:
            for points in reader.chunk_iterator(BATCH):
                xyz = np.column_stack([points.x, points.y, points.z]) * factors
                record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
                record.copy_fields_from(points)
                record.classification, record["pile"] = kinds.of(xyz)
                writer.write_points(record)
            if header.version.minor >= 4 and reader.header.evlrs:
                writer.write_evlrs(reader.header.evlrs)
    return held.getvalue()


def _header_of(found: Any) -> Any:  # noqa: ANN401 - laspy ships no types
    """Return a header for the copy, with the dimension for the pile and without an index."""
    import laspy  # noqa: PLC0415  (import divespot stays light)

    header = copy.deepcopy(found)
    header.generating_software = "divespot"
    header.vlrs = [vlr for vlr in header.vlrs if vlr.user_id.strip("\0 ") != "copc"]
    if "pile" not in header.point_format.dimension_names:
        about = laspy.ExtraBytesParams("pile", "uint16", "number of the pile, 0: none")
        header.add_extra_dim(about)
    return header


def _metres(header: Any, report: Report) -> NDArray[np.float64]:  # noqa: ANN401 - as above
    """Return the metres per unit of x, y and z."""
    plan = UNITS[report.source.unit]
    vertical = read_crs(header).vertical_unit if report.settings.unit == "auto" else None
    return np.array([plan, plan, UNITS.get(vertical or "", plan)])


def _converted(kinds: _Kinds, *, compress: bool) -> bytes:
    """Return a LAS file with the points of files in another format, or of several files."""
    import laspy  # noqa: PLC0415  (import divespot stays light)

    report = kinds.report
    points_m = _points_m(report)
    xyz = points_m / UNITS[report.source.unit]
    header = laspy.LasHeader(point_format=6, version="1.4")
    header = _header_of(header)
    header.scales = np.full(3, STEP)
    header.offsets = np.floor(xyz.min(axis=0))
    if (np.ptp(xyz, axis=0) > STEP * (2**31 - 1)).any():
        raise DivespotError(f"LAS cannot span over {STEP * 2**31:.0f} units at {STEP:g}")
    if wkt := _wkt(report.source.crs):
        header.global_encoding.wkt = True
        header.vlrs.append(laspy.VLR("LASF_Projection", _WKT, "WKT", wkt.encode() + b"\0"))
    las = laspy.LasData(header)
    las.xyz = xyz
    las.classification, las["pile"] = kinds.of(points_m)
    held = BytesIO()
    las.write(held, do_compress=compress)
    return held.getvalue()


def _wkt(crs: str | None) -> str | None:
    """Return a reference system as WKT; None if there is none, or pyproj is missing."""
    if crs is None or "[" in crs:
        return crs
    system = known_system(crs)
    return None if system is None else str(system.to_wkt("WKT1_GDAL"))


def _points_m(report: Report) -> NDArray[np.float64]:
    """Read the points of the scan's files again, without those that are not finite."""
    source, settings = report.source, report.settings
    # A given unit would apply to heights too, which a LAS file may have in another unit.
    unit = settings.unit if source.files else source.unit
    plan = plan_of(settings) if is_url(str(source.path)) else None
    files = source.files or str(source.path)
    scan = read(files, unit=unit, columns=settings.columns, plan=plan)
    return np.asarray(scan.points[np.isfinite(scan.points).all(axis=1)])
