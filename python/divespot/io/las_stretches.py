"""Stretches of LAS files: what is read at a time, by one of several threads or machines."""

from __future__ import annotations

import mmap
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError
from divespot.io import copc, las
from divespot.io.files import require_regular
from divespot.io.las_sample import ANY_SIZE

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    import laspy
    from numpy.typing import NDArray

    from divespot.io.las import Buffer

    Rectangle = tuple[float, float, float, float]

#: Points of a stretch, about: a twentieth of a second of work, and 20 MB.
STRETCH = 250_000

_FIRST_EXTENDED_FORMAT = 6


@dataclass(frozen=True)
class Stretch:
    """So many points of a file, from one of them on."""

    path: str
    begin: int
    count: int


@dataclass(frozen=True, eq=False)
class Records:
    """Points as a file holds them.

    Attributes
    ----------
    data
        The bytes of whole records.
    size
        Bytes of a record.
    is_extended
        Whether they are of format 6 or higher.
    scales, offsets
        How whole numbers become coordinates.

    """

    data: NDArray[np.uint8]
    size: int
    is_extended: bool
    scales: tuple[float, float, float]
    offsets: tuple[float, float, float]


def stretches_of(path: str, plan: Rectangle | None = None) -> list[Stretch]:
    """Return the stretches of a file, all counts in it checked.

    Parameters
    ----------
    path
    plan
        A rectangle in the file's numbers: of a COPC file, only chunks that meet it.

    Raises
    ------
    DivespotError
        The file is damaged or cannot be read.

    """
    file = Path(path)
    try:
        require_regular(file, ANY_SIZE)
        with (
            file.open("rb") as stream,
            mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
        ):
            return [Stretch(path, *span) for span in _spans(data, stream, plan)]
    except DivespotError as err:
        raise DivespotError(f"{path}: {err}") from None
    except (OSError, ValueError) as err:
        raise DivespotError(f"{path}: cannot be read ({err})") from None


def _spans(data: Buffer, stream: IO[bytes], plan: Rectangle | None) -> Iterator[tuple[int, int]]:
    las.check_header(data)
    try:
        with las.opened(stream) as reader:
            header = reader.header
            if not header.are_points_compressed:
                chunks: Iterable[tuple[int, bool]] = [(header.point_count, True)]
            else:
                las.check_chunks(data, stream, header)
                chunks = _chunks(stream, len(data), header, plan)
            yield from _grouped(chunks, header.point_count)
    except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
        raise las.refused(err) from None


def _chunks(
    stream: IO[bytes], size: int, header: laspy.LasHeader, plan: Rectangle | None
) -> list[tuple[int, bool]]:
    """Return the points of each chunk, and whether it is wanted."""
    table = copc.chunk_table(stream, header)
    if plan is None or not copc.is_copc(header):
        return [(count, True) for _, _, count in table]
    query = copc.Query.of(stream, size, header, plan)
    nodes = set() if query is None else {at for at, _, _ in query.nodes}
    return [(count, at in nodes) for at, _, count in table]


def _grouped(chunks: Iterable[tuple[int, bool]], points: int) -> Iterator[tuple[int, int]]:
    """Yield first point and number of points of stretches: of wanted chunks side by side."""
    begin = end = 0
    for count, is_wanted in chunks:
        after = min(end + count, points)
        if end > begin and (not is_wanted or after - begin > STRETCH):
            yield from _parts(begin, end)
            begin = end
        end = after
        if not is_wanted:
            begin = end
    yield from _parts(begin, end)


def _parts(begin: int, end: int) -> Iterator[tuple[int, int]]:
    """Yield the parts of one chunk that is larger than a stretch."""
    for at in range(begin, end, STRETCH):
        yield at, min(STRETCH, end - at)


def records_of(stretch: Stretch) -> Records:
    """Read a stretch.

    Raises
    ------
    DivespotError
        The file is damaged or cannot be read.

    """
    try:
        with Path(stretch.path).open("rb") as stream, las.opened(stream) as reader:
            reader.seek(stretch.begin)
            points, header = reader.read_points(stretch.count), reader.header
            _require_all(len(points), stretch)
            size = header.point_format.size
            return Records(
                *(points.array.view(np.uint8), size),
                is_extended=header.point_format.id >= _FIRST_EXTENDED_FORMAT,
                scales=tuple(header.scales.tolist()),
                offsets=tuple(header.offsets.tolist()),
            )
    except OSError as err:
        raise DivespotError(f"{stretch.path}: cannot be read ({err.strerror or err})") from None
    except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
        told = las.refused(err)
        if isinstance(told, DivespotError):
            raise DivespotError(f"{stretch.path}: {told}") from None
        raise told from None


def _require_all(read: int, stretch: Stretch) -> None:
    if read != stretch.count:
        raise DivespotError("it holds fewer points than its header promises: it is truncated")
