"""COPC over HTTP: reading the points of a rectangle from a file on a server by range requests."""

from __future__ import annotations

import mmap
import re
import struct
from http import HTTPStatus
from io import SEEK_CUR, SEEK_END, SEEK_SET, BufferedReader, RawIOBase
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError, damaged
from divespot.io import copc, las
from divespot.io.las_filter import LasFilter
from divespot.io.scan import RawCloud

if TYPE_CHECKING:
    import os

    from divespot.io.wanted import Wanted

#: What is said where nothing tells which part is wanted.
NEEDED = (
    "is on a server: a crop (x0,y0,z0,x1,y1,z1), or an outline, is needed of what is to be read"
)

#: What a file on a server begins with.
SCHEMES = ("http://", "https://")

#: Bytes fetched from the file's beginning: the header and its records, which are at least 1 kB.
HEAD_BYTES = 1 << 16

#: Chunks closer to each other than this many bytes are fetched together.
GAP_BYTES = 1 << 16

#: Timeout in seconds without a byte from a server.
PATIENCE_S = 30.0

#: Largest file in bytes: parts that are not fetched take address space, but no memory.
LARGEST_BYTES = 1 << 44

_TOTAL = re.compile(r"bytes \d+-\d+/(\d+)\Z")


def is_url(path: str | os.PathLike[str]) -> bool:
    """Return whether a path is the address of a file on a server."""
    return isinstance(path, str) and path.lower().startswith(SCHEMES)


def read_url(url: str, wanted: Wanted) -> RawCloud:
    """Read the points inside the wanted rectangle of a COPC file on a server.

    Raises
    ------
    DivespotError
        It is not a COPC file, no rectangle is given, or the server does not support ranges.

    """
    if wanted.plan is None:
        raise DivespotError(NEEDED)
    wanted.refuse_columns()
    remote = Remote(url)
    try:
        return _points(remote, wanted)
    except BaseException as err:  # noqa: BLE001 - a panic of lazrs is one
        raise las.refused(err) from None


def _points(remote: Remote, wanted: Wanted) -> RawCloud:
    las.check_header(remote.data)
    filtered = LasFilter(wanted)
    with BufferedReader(Mapped(remote.data)) as stream, las.opened(stream) as reader:
        header = reader.header
        if not copc.is_copc(header):
            raise DivespotError("is no COPC file: of other files on a server, a copy is needed")
        plan = las.rectangle(header, wanted)
        if plan is None:
            raise DivespotError(NEEDED)
        query = copc.Query.of(stream, remote.size, header, plan)
        if query is None:
            raise DivespotError("no point is inside the crop: a crop that meets it is needed")
        remote.fetch_all((at, at + size) for at, size, _ in query.nodes)
        for node in query.nodes:
            las.check_layers(remote.data, header, node)
        xyz = las.kept(query.points(), filtered, header)
        crs = las.read_crs(header)
    warnings = (*crs.warnings, *filtered.told(len(xyz)))
    return RawCloud(xyz, crs.unit, crs.vertical_unit, crs.text, warnings, projected=crs.projected)


class Mapped(RawIOBase):
    """Memory that can be read like a file."""

    def __init__(self, data: mmap.mmap) -> None:
        self._data, self._at = data, 0

    def readable(self) -> bool:
        """Return True."""
        return True

    def seekable(self) -> bool:
        """Return True."""
        return True

    def seek(self, offset: int, whence: int = SEEK_SET) -> int:
        """Set the position."""
        start = {SEEK_SET: 0, SEEK_CUR: self._at, SEEK_END: len(self._data)}[whence]
        self._at = max(start + offset, 0)
        return self._at

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401 - what bytes are written into
        """Read as many bytes as fit into a buffer."""
        found = self._data[self._at : self._at + len(buffer)]
        buffer[: len(found)] = found
        self._at += len(found)
        return len(found)


class Remote:
    """A file on a server; `data` holds the fetched parts, and zeros elsewhere.

    Header and records, and everything behind the points, are fetched first.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        head, self.size = self._got(0, HEAD_BYTES)
        if not head.startswith(b"LASF"):
            raise DivespotError("is no COPC file: of other files on a server, a copy is needed")
        # The system keeps no memory for pages that were never written.
        self.data = mmap.mmap(-1, self.size)
        self.data[: len(head)] = head
        self._fetch(min(self._end_of_points(), self.size), self.size)

    def fetch_all(self, ranges: Any) -> None:  # noqa: ANN401 - pairs of begin and end
        """Fetch ranges, adjacent ones together."""
        joined: list[list[int]] = []
        for begin, end in sorted(ranges):
            if joined and begin - joined[-1][1] <= GAP_BYTES:
                joined[-1][1] = max(joined[-1][1], end)
            else:
                joined.append([begin, end])
        for begin, end in joined:
            self._fetch(begin, end)

    def _end_of_points(self) -> int:
        """Return where the chunk table begins, after the chunks."""
        try:
            start: int = struct.unpack_from("<I", self.data, 96)[0]
            if start + 8 > HEAD_BYTES:
                self._fetch(start, start + 8)
            return max(int(struct.unpack_from("<q", self.data, start)[0]), HEAD_BYTES)
        except struct.error:
            raise damaged("it ends inside its header") from None

    def _fetch(self, begin: int, end: int) -> None:
        if not 0 <= begin <= end <= self.size:
            raise damaged("its octree lies outside of the file")
        if begin < end:
            self.data[begin:end] = self._got(begin, end)[0]

    def _got(self, begin: int, end: int) -> tuple[bytes, int]:
        """Return bytes of the file, and the file's size."""
        from http.client import HTTPException  # noqa: PLC0415 - slow to import
        from urllib.error import HTTPError  # noqa: PLC0415 - as above
        from urllib.request import Request, urlopen  # noqa: PLC0415 - as above

        request = Request(self._url, headers={"Range": f"bytes={begin}-{end - 1}"})  # noqa: S310 - checked
        try:
            with urlopen(request, timeout=PATIENCE_S) as answer:  # noqa: S310 - as above
                status, told = answer.status, answer.headers.get("Content-Range", "")
                total = _TOTAL.match(told)
                if status != HTTPStatus.PARTIAL_CONTENT or total is None:
                    raise DivespotError("the server sends no ranges: a copy of the file is needed")
                data: bytes = answer.read(end - begin)
        except HTTPError as error:
            error.close()
            told = f"the server refuses ({error.code} {error.reason})"
            raise DivespotError(f"{told}: a file that it gives is needed") from None
        except (OSError, HTTPException, ValueError) as error:
            if isinstance(error, DivespotError):
                raise
            told = f"cannot be reached ({getattr(error, 'reason', None) or error})"
            raise DivespotError(f"{told}: a server that answers is needed") from None
        size = int(total[1])
        if not 0 < size <= LARGEST_BYTES or len(data) != min(end, size) - begin:
            raise DivespotError(
                "the server sent less than was asked for: a copy of the file is needed"
            )
        return data, size
