"""A sample of a LAS or LAZ file of any size in under a second: its header and some stretches."""

from __future__ import annotations

import mmap
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import damaged
from divespot.io import las
from divespot.io.files import require_regular
from divespot.io.las_filter import LasFilter
from divespot.io.scan import FloatArray, RawCloud, Whole, stack

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import laspy

    from divespot.io.wanted import Wanted

#: Up to this many points, all are read; of larger files, a number of stretches of some points.
MOST, STRETCHES, STRETCH = 1_000_000, 40, 5_000

#: A file size that no file has.
ANY_SIZE = 1 << 62

#: How a LAS file begins.
SIGNATURE = b"LASF"


def begins_as_las(file: Path) -> bool:
    """Return whether a regular file, of whatever size, begins as a LAS file does."""
    require_regular(file, ANY_SIZE)
    with file.open("rb") as stream:
        return stream.read(len(SIGNATURE)) == SIGNATURE


def sample_las(file: Path, wanted: Wanted) -> RawCloud:
    """Read some of a file's points, and what its header states about all of them.

    Raises
    ------
    DivespotError
        The file is damaged, or no point is wanted.
    OSError
        The file cannot be read.

    """
    with (
        file.open("rb") as stream,
        mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
    ):
        las.check_header(data)
        wanted_ones = LasFilter(wanted)
        kept = las.kept if wanted.stretches is None else _every_one
        try:
            with las.opened(stream) as reader:
                header = reader.header
                if header.are_points_compressed:
                    at = stream.tell()
                    las.check_chunks(data, stream, header)
                    stream.seek(at)
                parts = [kept(points, wanted_ones, header) for points in _some(reader, wanted)]
                crs = las.read_crs(header)
        except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
            raise las.refused(err) from None
    xyz: FloatArray = np.concatenate([np.empty((0, 3)), *parts])
    told = wanted_ones.told(len(xyz)) if wanted.stretches is None else ()
    warnings = (*crs.warnings, *told)
    whole = Whole(
        header.point_count, tuple(header.mins), tuple(header.maxs), wanted_ones.seen_classes
    )
    return RawCloud(
        *(xyz, crs.unit, crs.vertical_unit, crs.text, warnings),
        projected=crs.projected,
        whole=whole,
    )


def _every_one(points: Any, _: LasFilter, header: laspy.LasHeader) -> FloatArray:  # noqa: ANN401 - untyped
    """Return x, y, z of all points of a batch, whatever their class."""
    return las.scaled(stack([points.X, points.Y, points.Z]), header)


def _some(reader: laspy.LasReader, wanted: Wanted) -> Iterator[Any]:
    """Yield all points, or stretches spread over the file that begin with a chunk."""
    count, stretches = reader.header.point_count, wanted.stretches or STRETCHES
    if count <= (MOST if wanted.stretches is None else stretches * STRETCH):
        yield _stretch(reader, 0, count)
        return
    chunk = _chunk_size(reader)
    for i in range(stretches):
        yield _stretch(reader, i * (count // stretches) // chunk * chunk, STRETCH)


def _chunk_size(reader: laspy.LasReader) -> int:
    """Return how many points are compressed together: reading must begin with the first one."""
    if not reader.header.are_points_compressed:
        return 1
    import lazrs  # noqa: PLC0415  (import divespot stays light)

    vlr = lazrs.LazVlr(reader.header.vlrs.get("LasZipVlr")[0].record_data)
    return 1 if vlr.uses_variable_size_chunks() else max(1, vlr.chunk_size())


def _stretch(reader: laspy.LasReader, begin: int, count: int) -> Any:  # noqa: ANN401 - untyped
    if not count:
        return reader.read_points(0)
    reader.seek(begin)
    points = reader.read_points(count)
    if len(points) < min(count, reader.header.point_count - begin):
        raise damaged("it holds fewer points than its header promises")
    return points
