"""COPC, a LAZ file with an octree: reading the points of a rectangle without the others."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import damaged

if TYPE_CHECKING:
    import laspy

    from divespot.io.scan import FloatArray

#: How many times its size the file may be read for its octree: a page may contain itself.
TIMES = 4


def is_copc(header: laspy.LasHeader) -> bool:
    """Return whether a file's header says that it has an octree."""
    return bool(header.vlrs) and type(header.vlrs[0]).__name__ == "CopcInfoVlr"


@dataclass(frozen=True)
class Query:
    """A query of an octree for a rectangle.

    Attributes
    ----------
    nodes
        For each chunk that the rectangle meets: where it begins, its bytes and its points.

    """

    nodes: tuple[tuple[int, int, int], ...]
    _reader: Any
    _bounds: Any

    @classmethod
    def of(
        cls,
        stream: Any,  # noqa: ANN401 - an object with read, seek and tell
        size: int,
        header: laspy.LasHeader,
        plan: tuple[float, float, float, float],
    ) -> Query | None:
        """Query the rectangle x0, y0, x1, y1; None if the file, of `size` bytes, is outside.

        Raises
        ------
        DivespotError
            The octree describes more than the file holds.

        """
        from laspy import copc  # noqa: PLC0415 - as laspy itself

        low: FloatArray = np.maximum(plan[:2], header.mins[:2])
        high: FloatArray = np.minimum(plan[2:], header.maxs[:2])
        if not (low < high).all():
            return None
        known = _chunks(stream, header)
        source = _Limited(stream, TIMES * size)
        stream.seek(0)
        reader = copc.CopcReader(source, close_fd=False)
        bounds = copc.Bounds(mins=low, maxs=high)
        whole = bounds.ensure_3d(header.mins, header.maxs)
        nodes = copc.load_octree_for_query(
            source, reader.copc_info, reader.root_page, query_bounds=whole
        )
        held = [
            (node.offset, node.byte_size, node.point_count) for node in nodes if node.point_count
        ]
        if not known.issuperset(held) or len(set(held)) < len(held):
            raise damaged("its octree and its chunk table disagree")
        return cls(tuple(held), reader, bounds)

    def points(self) -> Any:  # noqa: ANN401 - laspy ships no types
        """Return the points inside the rectangle."""
        return self._reader.query(self._bounds)


def _chunks(stream: Any, header: laspy.LasHeader) -> set[tuple[int, int, int]]:  # noqa: ANN401 - as above
    """Return where each chunk begins, its bytes and its points, from the checked chunk table."""
    return set(chunk_table(stream, header))


def chunk_table(
    stream: Any,  # noqa: ANN401 - as above
    header: laspy.LasHeader,
) -> list[tuple[int, int, int]]:
    """Return the chunks of any LAZ file, in order; a table of equal chunks has no point counts."""
    import lazrs  # noqa: PLC0415  (import divespot stays light)

    vlr = lazrs.LazVlr(header.vlrs.get("LasZipVlr")[0].record_data)
    begin: int = header.offset_to_point_data
    stream.seek(begin)
    table = lazrs.read_chunk_table(stream, vlr)
    begins = itertools.accumulate((size for _, size in table), initial=begin + 8)
    known = vlr.uses_variable_size_chunks()
    return [
        (at, size, count if known else vlr.chunk_size())
        for at, (count, size) in zip(begins, table, strict=False)
    ]


class _Limited:
    """A stream from which only a limited number of bytes can be read."""

    def __init__(self, stream: Any, most: int) -> None:  # noqa: ANN401 - as above
        self._stream, self._left = stream, most
        self.seek, self.tell = stream.seek, stream.tell

    def read(self, size: int = -1) -> bytes:
        data: bytes = self._stream.read(size)
        self._left -= len(data) + 1
        if self._left < 0:
            raise damaged("its octree goes in circles")
        return data
