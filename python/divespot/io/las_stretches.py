"""Stretches of LAS files: the amount read at a time, by one of several threads or machines."""

from __future__ import annotations

import mmap
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError, unreadable
from divespot.io import copc, las
from divespot.io.las_sample import begins_as_las
from divespot.io.wanted import Wanted

if TYPE_CHECKING:
    from collections.abc import Iterator

    import laspy
    from numpy.typing import NDArray

    from divespot.io.las import Buffer

#: Points of a stretch, about: a twentieth of a second of work, and 20 MB.
STRETCH = 250_000

#: Most points of a LAZ chunk, which is unpacked whole: half a gigabyte.
MOST_OF_CHUNK = 2**24

_FIRST_EXTENDED_FORMAT = 6


@dataclass(frozen=True)
class Layout:
    """How the points of a file are stored.

    Attributes
    ----------
    size
        Bytes per record.
    is_extended
        Whether the record format is 6 or higher.
    scales, offsets
        Conversion of integers to coordinates.
    packed
        LASzip's description of the compression; None if points are not compressed.

    """

    size: int
    is_extended: bool
    scales: tuple[float, float, float]
    offsets: tuple[float, float, float]
    packed: bytes | None

    @classmethod
    def of(cls, header: laspy.LasHeader) -> Layout:
        """Return the layout that a header describes."""
        packed = None
        if header.are_points_compressed:
            packed = bytes(header.vlrs.get("LasZipVlr")[0].record_data)
        return cls(
            header.point_format.size,
            header.point_format.id >= _FIRST_EXTENDED_FORMAT,
            tuple(header.scales.tolist()),
            tuple(header.offsets.tolist()),
            packed,
        )


@dataclass(frozen=True)
class Stretch:
    """Consecutive points in a file: the byte where they begin, points and bytes of each chunk."""

    path: str
    at: int
    chunks: tuple[tuple[int, int], ...]
    layout: Layout

    @property
    def count(self) -> int:
        """Number of points."""
        return sum(count for count, _ in self.chunks)


def stretches_of(path: str, wanted: Wanted | None = None) -> list[Stretch]:
    """Return the stretches of a file, all counts in it checked.

    Parameters
    ----------
    path
    wanted
        Of a COPC file, only chunks that meet the rectangle that is wanted.

    Raises
    ------
    DivespotError
        The file is damaged or cannot be read.

    """
    file = Path(path)
    try:
        if not begins_as_las(file):
            raise DivespotError("it is no LAS or LAZ file, which is needed")  # noqa: TRY301
        with (
            file.open("rb") as stream,
            mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
        ):
            return _stretches(path, data, stream, wanted or Wanted())
    except DivespotError as err:
        raise DivespotError(f"{path}: {err}") from None
    except (OSError, ValueError) as err:
        raise unreadable(path, err) from None


def _stretches(path: str, data: Buffer, stream: IO[bytes], wanted: Wanted) -> list[Stretch]:
    las.check_header(data)
    try:
        with las.opened(stream) as reader:
            header = reader.header
            layout = Layout.of(header)
            if layout.packed is None:
                chunks = _records(header)
            else:
                las.check_chunks(data, stream, header)
                chunks = _chunks(stream, len(data), header, wanted)
    except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
        raise las.refused(err) from None
    return [
        Stretch(path, some[0].at, tuple((one.count, one.size) for one in some), layout)
        for some in _grouped(chunks)
    ]


@dataclass(frozen=True)
class _Chunk:
    at: int
    count: int
    size: int


def _records(header: laspy.LasHeader) -> list[_Chunk]:
    """Return stretches of uncompressed records."""
    size, points = header.point_format.size, header.point_count
    counts = ((begin, min(STRETCH, points - begin)) for begin in range(0, points, STRETCH))
    start = header.offset_to_point_data
    return [_Chunk(start + begin * size, count, count * size) for begin, count in counts]


def _chunks(stream: IO[bytes], size: int, header: laspy.LasHeader, wanted: Wanted) -> list[_Chunk]:
    """Return the chunks that are wanted, in the order of the file."""
    found, left = [], header.point_count
    for at, held, count in copc.chunk_table(stream, header):
        found.append(_Chunk(at, min(count, left), held))
        left -= found[-1].count
    largest = max((chunk.count for chunk in found), default=0)
    if largest > MOST_OF_CHUNK:
        raise DivespotError(
            f"a chunk of its LAZ holds {largest} points: at most {MOST_OF_CHUNK} are needed, as "
            "laszip and PDAL write them"
        )
    plan = las.rectangle(header, wanted) if copc.is_copc(header) else None
    if plan is None:
        return [chunk for chunk in found if chunk.count]
    query = copc.Query.of(stream, size, header, plan)
    if query is None:
        return found
    nodes = {at for at, _, _ in query.nodes}
    return [chunk for chunk in found if chunk.at in nodes]


def _grouped(chunks: list[_Chunk]) -> Iterator[list[_Chunk]]:
    """Yield groups of consecutive chunks, each with about as many points as a stretch."""
    some: list[_Chunk] = []
    for chunk in chunks:
        is_next = some and some[-1].at + some[-1].size == chunk.at
        if some and not (is_next and sum(one.count for one in some) + chunk.count <= STRETCH):
            yield some
            some = []
        some.append(chunk)
    if some:
        yield some


def records_of(stretch: Stretch) -> NDArray[np.uint8]:
    """Read the records of a stretch.

    Raises
    ------
    DivespotError
        The file is damaged or cannot be read.

    """
    try:
        with Path(stretch.path).open("rb") as stream:
            stream.seek(stretch.at)
            data = stream.read(sum(size for _, size in stretch.chunks))
    except OSError as err:
        raise unreadable(stretch.path, err) from None
    if len(data) < sum(size for _, size in stretch.chunks):
        raise DivespotError(
            f"{stretch.path}: became shorter while it was read: a whole file is needed"
        )
    if stretch.layout.packed is None:
        return np.frombuffer(data, np.uint8)
    try:
        return _unpacked(data, stretch)
    except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
        told = las.refused(err)
        if isinstance(told, DivespotError):
            raise DivespotError(f"{stretch.path}: {told}") from None
        raise told from None


def _unpacked(data: bytes, stretch: Stretch) -> NDArray[np.uint8]:
    """Unpack chunk by chunk; for several chunks at once, lazrs would start its own threads."""
    import lazrs  # noqa: PLC0415  (import divespot stays light)

    layout, selection = stretch.layout, las.selection().to_lazrs()
    records = np.empty(stretch.count * layout.size, np.uint8)
    begin = at = 0
    for count, size in stretch.chunks:
        end = begin + count * layout.size
        lazrs.decompress_points_with_chunk_table(
            *(data[at : at + size], layout.packed, records[begin:end]), [(count, size)], selection
        )
        begin, at = end, at + size
    return records
