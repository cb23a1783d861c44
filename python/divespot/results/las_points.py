"""The scan's points as LAS, classified by ground and pile."""

from __future__ import annotations

import copy
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from divespot._arguments import require_kind
from divespot.errors import DivespotError
from divespot.io import UNITS, las, read
from divespot.io.files import bytes_of
from divespot.io.las import read_crs
from divespot.io.las_filter import LasFilter
from divespot.io.las_sample import SIGNATURE, begins_as_las
from divespot.io.packed import unpacked
from divespot.io.systems import known_system
from divespot.io.wanted import Wanted
from divespot.io.web import is_url
from divespot.narrowing import plan_of
from divespot.output import other_ending, refuse_inputs, whole
from divespot.report import Report
from divespot.results.pile_matching import labels
from divespot.settings import given

if TYPE_CHECKING:
    import os
    from collections.abc import Iterable, Iterator, Sequence

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
        raise other_ending(path, "points", ENDINGS)
    if report.source.path is None:
        raise DivespotError("an array was measured: a scan's file is needed to write its points")
    refuse_inputs(path, "the points", report.inputs)
    kinds = _Kinds(report)
    with whole(path) as stream:
        # Headers are completed after the points: what cannot go back, a pipe, is written at once.
        target = stream if stream.seekable() else BytesIO()
        _write(kinds, target, compress=ending == ".laz")
        if isinstance(target, BytesIO):
            stream.write(target.getvalue())


def _write(kinds: _Kinds, stream: BinaryIO, *, compress: bool) -> None:
    source = kinds.report.source
    paths = source.files or (str(source.path),)
    if any(is_url(path) for path in paths):
        _convert(_of_any(kinds.report), kinds, stream, compress=compress)
    elif len(paths) == 1:
        with _opened(paths[0]) as file:
            if file is None:
                _convert(_of_any(kinds.report), kinds, stream, compress=compress)
            else:
                _annotate(file, kinds, stream, compress=compress)
    elif all(begins_as_las(Path(path)) for path in paths):
        _convert(_of_las(paths, kinds.report), kinds, stream, compress=compress)
    else:
        _convert(_of_any(kinds.report), kinds, stream, compress=compress)


@contextmanager
def _opened(path: str) -> Iterator[BinaryIO | None]:
    """Open a LAS file, which may be packed; None if it is another."""
    if begins_as_las(Path(path)):
        with Path(path).open("rb") as file:
            yield file
        return
    _, data = unpacked(Path(path), bytes_of(Path(path)))
    yield BytesIO(data) if data.startswith(SIGNATURE) else None


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


def _annotate(file: BinaryIO, kinds: _Kinds, stream: BinaryIO, *, compress: bool) -> None:
    """Write a LAS file with every point of another."""
    import laspy  # noqa: PLC0415  (import divespot stays light)

    with laspy.open(file, laz_backend=laspy.LazBackend.Lazrs, closefd=False) as reader:
        factors = _metres(reader.header, kinds.report)
        header = _header_of(reader.header)
        with laspy.open(stream, "w", header=header, do_compress=compress, closefd=False) as writer:
            for points in reader.chunk_iterator(BATCH):
                xyz = np.column_stack([points.x, points.y, points.z]) * factors
                record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
                record.copy_fields_from(points)
                record.classification, record["pile"] = kinds.of(xyz)
                writer.write_points(record)
            if header.version.minor >= 4 and reader.header.evlrs:
                writer.write_evlrs(reader.header.evlrs)


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


@dataclass(frozen=True, eq=False)
class _Points:
    """Points in the scan's frame, in metres, batch by batch, and the box around them."""

    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    batches: Iterable[NDArray[np.float64]]


def _convert(points: _Points, kinds: _Kinds, stream: BinaryIO, *, compress: bool) -> None:
    """Write a LAS file with the points of files in another format, or of several."""
    import laspy  # noqa: PLC0415  (import divespot stays light)

    source = kinds.report.source
    metres = UNITS[source.unit]
    header = _header_of(laspy.LasHeader(point_format=6, version="1.4"))
    header.scales = np.full(3, STEP)
    header.offsets = np.floor(points.low_m / metres)
    span_m = points.high_m - points.low_m
    if (span_m > metres * STEP * (2**31 - 1)).any():
        span, most = span_m.max() / metres, STEP * 2**31
        raise DivespotError(
            f"the points span {span:.0f} units: at most {most:.0f} are needed in LAS"
        )
    if wkt := _wkt(source.crs):
        header.global_encoding.wkt = True
        header.vlrs.append(laspy.VLR("LASF_Projection", _WKT, "WKT", wkt.encode() + b"\0"))
    with laspy.open(stream, "w", header=header, do_compress=compress, closefd=False) as writer:
        for xyz_m in points.batches:
            record = laspy.ScaleAwarePointRecord.zeros(len(xyz_m), header=header)
            record.x, record.y, record.z = (xyz_m / metres).T
            record.classification, record["pile"] = kinds.of(xyz_m)
            writer.write_points(record)


def _wkt(crs: str | None) -> str | None:
    """Return a reference system as WKT; None if there is none, or pyproj is missing."""
    if crs is None or "[" in crs:
        return crs
    system = known_system(crs)
    return None if system is None else str(system.to_wkt("WKT1_GDAL"))


def _of_any(report: Report) -> _Points:
    """Return the points of the scan's files once more, without those that are not finite."""
    source, settings = report.source, report.settings
    # A given unit would apply to heights too, which a LAS file may have in another unit.
    unit = settings.unit if source.files else source.unit
    plan = plan_of(settings) if is_url(str(source.path)) else None
    files = source.files or str(source.path)
    scan = read(files, unit=unit, columns=settings.columns, plan=plan)
    points = np.asarray(scan.points[np.isfinite(scan.points).all(axis=1)])
    return _Points(points.min(axis=0), points.max(axis=0), [points])


def _of_las(paths: Sequence[str], report: Report) -> _Points:
    """Return the points of LAS files, without those that are withheld or noise."""
    corners = []
    for path in paths:
        with Path(path).open("rb") as file, las.opened(file) as reader:
            box = np.array([reader.header.mins, reader.header.maxs])
            corners.append(box * _metres(reader.header, report))
    box = np.concatenate(corners)
    return _Points(box.min(axis=0), box.max(axis=0), _batches(paths, report))


def _batches(paths: Sequence[str], report: Report) -> Iterator[NDArray[np.float64]]:
    for path in paths:
        with Path(path).open("rb") as file, las.opened(file) as reader:
            factors, wanted = _metres(reader.header, report), LasFilter(Wanted())
            for points in reader.chunk_iterator(BATCH):
                yield las.kept(points, wanted, reader.header) * factors
