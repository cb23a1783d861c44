"""LAS and LAZ (also COPC), through laspy and lazrs."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.io import copc
from divespot.io.crs import Crs, crs_from_geokeys, crs_from_wkt
from divespot.io.las_filter import LasFilter
from divespot.io.records import require_bytes
from divespot.io.scan import FloatArray, RawCloud, stack

if TYPE_CHECKING:
    import mmap
    from collections.abc import Mapping

    import laspy

    from divespot.io.wanted import Rectangle, Wanted

    Buffer = bytes | mmap.mmap

# Memory in bytes for one batch of unpacked records. Read in batches, since the point count of a LAZ
# file cannot be checked against its size beforehand.
_BATCH_BYTES = 32 << 20
_COMPRESSED_BIT = 0x80
# Offset of the minor version in a header, and the first one whose counts have eight bytes.
_MINOR_VERSION, _WIDE_COUNTS = 25, 4
_FIRST_LAYERED_FORMAT = 6
# Record id under 'laszip encoded', and its first number if points are compressed one by one.
_LASZIP, _POINTWISE = 22204, 1
# Record ids under 'LASF_Projection'.
_WKT, _GEOKEYS, _DOUBLES, _ASCII = 2112, 34735, 34736, 34737


def read_las(data: bytes, wanted: Wanted) -> RawCloud:
    """Read scaled x, y, z of the wanted points, and the units that the reference system states."""
    wanted.refuse_columns()
    check_header(data)
    wanted_ones = LasFilter(wanted)
    try:
        with opened(BytesIO(data)) as reader:
            if reader.header.are_points_compressed:
                check_chunks(data, BytesIO(data), reader.header)
            xyz = _read_points(reader, wanted_ones, data)
            crs = read_crs(reader.header)
    except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
        raise refused(err) from None
    warnings = (*crs.warnings, *wanted_ones.told(len(xyz)))
    return RawCloud(xyz, crs.unit, crs.vertical_unit, crs.text, warnings, projected=crs.projected)


def opened(stream: IO[bytes]) -> laspy.LasReader:
    """Open a LAS file to read its points.

    With one thread: with several, lazrs aborts the process on a corrupt chunk table, and is no
    faster here.
    """
    import laspy  # noqa: PLC0415  (import divespot stays light)

    backend, parts = laspy.LazBackend.Lazrs, selection()
    return laspy.open(stream, closefd=False, laz_backend=backend, decompression_selection=parts)


def selection() -> laspy.DecompressionSelection:
    """Return which fields of a point are unpacked, if not all are needed."""
    import laspy  # noqa: PLC0415  (import divespot stays light)

    parts = laspy.DecompressionSelection
    return parts.base() | parts.Z | parts.CLASSIFICATION | parts.FLAGS


def refused(err: BaseException) -> BaseException:
    """Return the exception to raise for one of laspy or lazrs.

    They document no exceptions; whatever they raise, the file is at fault. A panic in lazrs arrives
    as a BaseException of a type that cannot be imported.
    """
    is_panic = type(err).__name__ == "PanicException"
    if isinstance(err, DivespotError) or not (isinstance(err, Exception) or is_panic):
        return err
    return damaged(f"not a readable LAS or LAZ file ({type(err).__name__}: {err})")


def points_promised(data: Buffer) -> int:
    """Return a header's point count; IndexError or struct.error if the header is incomplete."""
    kind, at = ("<Q", 247) if data[_MINOR_VERSION] >= _WIDE_COUNTS else ("<I", 107)
    return int(struct.unpack_from(kind, data, at)[0])


def check_header(data: Buffer) -> None:
    """Check all counts in the header against the file's size before laspy uses them."""
    try:
        count = points_promised(data)
        header_size, start, vlrs, kind, stride = struct.unpack_from("<HIIBH", data, 94)
        evlr_start = evlrs = 0
        if data[_MINOR_VERSION] >= _WIDE_COUNTS:
            evlr_start, evlrs = struct.unpack_from("<QI", data, 235)
        if kind & _COMPRESSED_BIT:
            _refuse_pointwise(data, header_size, vlrs)
            _check_chunk_table(data, start, count)
    except (IndexError, struct.error):
        raise damaged("it ends inside its header or its LAZ chunk table") from None
    if header_size + vlrs * 54 > start or evlr_start + evlrs * 60 > len(data):
        raise damaged("its LAS header promises more records than it holds")
    if not kind & _COMPRESSED_BIT:
        require_bytes(count * stride, len(data) - start, count)


def _refuse_pointwise(data: Buffer, at: int, vlrs: int) -> None:
    """Refuse points that are compressed one by one, for which there is no chunk table."""
    for _ in range(vlrs):
        record, size = struct.unpack_from("<2H", data, at + 18)
        if record == _LASZIP and struct.unpack_from("<H", data, at + 54)[0] == _POINTWISE:
            raise DivespotError(
                "it is LAZ without chunks (LASzip compressor 1): a file with chunks is needed, "
                "rewritten with laszip or PDAL"
            )
        at += 54 + size


def _table_offset(data: Buffer, start: int) -> int:
    """Return where the chunk table begins, for points that begin at `start`."""
    offset: int = struct.unpack_from("<q", data, start)[0]
    if offset <= start:
        # A writer that cannot seek stores the offset at the end of the file.
        offset = struct.unpack_from("<q", data, len(data) - 8)[0]
    return offset


def _check_chunk_table(data: Buffer, start: int, count: int) -> None:
    """Check the size of the chunk table; raises struct.error if there is none."""
    _, chunks = struct.unpack_from("<II", data, max(_table_offset(data, start), start))
    if chunks > min(count, len(data)):
        raise damaged(f"its LAZ chunk table promises {chunks} chunks")


def check_chunks(data: Buffer, stream: IO[bytes], header: laspy.LasHeader) -> None:
    """Check the sizes from which lazrs allocates memory: of records, chunks and their layers."""
    import lazrs  # noqa: PLC0415  (import divespot stays light)

    start = header.offset_to_point_data
    vlr = lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data)
    stream.seek(start)
    table = lazrs.read_chunk_table(stream, vlr)
    if start + 8 + sum(size for _, size in table) != _table_offset(data, start):
        raise damaged("its LAZ chunks and its chunk table disagree")
    if vlr.item_size() != header.point_format.size:
        raise damaged("its LAZ record and its LAS header disagree")
    sizes = [vlr.chunk_size()] * len(table)
    if vlr.uses_variable_size_chunks():
        sizes = [counted for counted, _ in table]
    # Behind the last chunk, lazrs reads whatever follows as a chunk.
    if sum(sizes) < header.point_count:
        raise damaged(
            f"the header promises {header.point_count} points but its LAZ chunks hold {sum(sizes)}"
        )
    at, left = start + 8, header.point_count
    for counted, (_, size) in zip(sizes, table, strict=True):
        check_layers(data, header, (at, size, min(counted, left)))
        at, left = at + size, left - min(counted, left)


def check_layers(data: Buffer, header: laspy.LasHeader, chunk: tuple[int, int, int]) -> None:
    """Check the layers of a chunk, given where it begins, its bytes and its points."""
    if header.point_format.id < _FIRST_LAYERED_FORMAT:
        return
    at, size, count = chunk
    # A chunk is a point, the number of points, and a size for each layer: x and y, z, class,
    # flags and so on.
    promised, *layers = struct.unpack_from("<5I", data, at + header.point_format.size)
    if sum(layers) > size or promised != count:
        raise damaged("its LAZ layers and their chunk disagree")


def _read_points(reader: laspy.LasReader, wanted: LasFilter, data: bytes) -> FloatArray:
    header = reader.header
    plan = rectangle(header, wanted.wanted) if copc.is_copc(header) else None
    if plan is not None:
        query = copc.Query.of(BytesIO(data), len(data), header, plan)
        some = () if query is None else query.points()
        if len(some):
            return kept(some, wanted, header)
    batch = max(1, _BATCH_BYTES // header.point_format.size)
    parts = [np.empty((0, 3))]
    held = 0
    for points in reader.chunk_iterator(batch):
        held += len(points)
        parts.append(kept(points, wanted, header))
    if held != header.point_count:
        raise damaged(f"the header promises {header.point_count} points but the file holds {held}")
    return np.concatenate(parts)


def kept(points: Any, wanted: LasFilter, header: laspy.LasHeader) -> FloatArray:  # noqa: ANN401
    """Return x, y, z of the wanted points of a batch."""
    raw = stack([points.X, points.Y, points.Z])
    keeps = wanted.keeps(points)
    if not keeps.all():
        raw = raw.compress(keeps, axis=0)
    return scaled(raw, header)


def scaled(raw: FloatArray, header: laspy.LasHeader) -> FloatArray:
    """Convert integers to coordinates, in the same array."""
    # A corrupt scale may overflow to inf, which is dropped and counted later.
    with np.errstate(over="ignore", invalid="ignore"):
        raw *= header.scales
        raw += header.offsets
    return raw


def rectangle(header: laspy.LasHeader, wanted: Wanted) -> Rectangle | None:
    """Return the rectangle outside of which no point of a file is wanted, if there is one."""
    low, high = header.mins.tolist(), header.maxs.tolist()
    return None if wanted.plan is None else wanted.rectangle(read_crs(header).text, low, high)


def read_crs(header: laspy.LasHeader) -> Crs:
    """Return the system of the WKT record, or else of the GeoTIFF keys."""
    records = [*header.vlrs, *(header.evlrs or [])]
    projection = {v.record_id: v for v in records if v.user_id.strip("\0 ") == "LASF_Projection"}
    wkt = projection[_WKT].string.strip("\0 \n") if _WKT in projection else ""
    if wkt:
        return crs_from_wkt(wkt)
    return crs_from_geokeys(_geokeys(projection)) if _GEOKEYS in projection else Crs()


def _geokeys(records: Mapping[int, Any]) -> dict[int, int | float | str]:
    """Return GeoTIFF keys, with their values looked up in the records that hold them."""
    doubles = [d.value for d in records[_DOUBLES].doubles] if _DOUBLES in records else []
    text = (
        records[_ASCII].record_data_bytes().decode("ascii", "replace") if _ASCII in records else ""
    )
    keys: dict[int, int | float | str] = {}
    for key in records[_GEOKEYS].geo_keys:
        at = key.value_offset
        if key.tiff_tag_location == 0:
            keys[key.id] = at
        elif key.tiff_tag_location == _DOUBLES and at < len(doubles):
            keys[key.id] = doubles[at]
        elif key.tiff_tag_location == _ASCII:
            keys[key.id] = text[at : at + key.count].strip("|\0 ")
    return keys
