"""Which format a file is in."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot.errors import DivespotError
from divespot.io.las import read_las
from divespot.io.npy import read_npy, read_npz
from divespot.io.pcd import read_pcd
from divespot.io.ply import read_ply
from divespot.io.text import read_text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import PurePath

    from divespot.io.scan import RawCloud
    from divespot.io.wanted import Wanted


@dataclass(frozen=True)
class Format:
    """A file format: how its files begin, what they are called, who reads them."""

    name: str
    begins: re.Pattern[bytes]
    extensions: tuple[str, ...]
    read: Callable[[bytes, Wanted], RawCloud]


def _whole(read: Callable[[bytes], RawCloud]) -> Callable[[bytes, Wanted], RawCloud]:
    """Return a reader of a format that leaves nothing to choose."""

    def read_all(data: bytes, wanted: Wanted) -> RawCloud:
        if wanted.columns is not None:
            raise DivespotError("it is no table of text: columns cannot be chosen, leave them out")
        return read(data)

    return read_all


_COMMENT_LINES = rb"(?:[ \t]*(?:#[^\r\n]*)?[\r\n])*[ \t]*"
# Text without a NUL; or UTF-16, which has them, by its byte order mark.
_TEXT_START = re.compile(rb"\xff\xfe|\xfe\xff|[^\0]*\Z")
FORMATS = (
    Format("PLY", re.compile(rb"\s*ply[ \t]*[\r\n]"), (".ply",), _whole(read_ply)),
    Format(
        "PCD",
        re.compile(_COMMENT_LINES + rb"(VERSION|FIELDS|COLUMNS)\s"),
        (".pcd",),
        _whole(read_pcd),
    ),
    Format("LAS/LAZ", re.compile(rb"LASF"), (".las", ".laz"), read_las),
    Format("NPY", re.compile(rb"\x93NUMPY"), (".npy",), _whole(read_npy)),
    Format("NPZ", re.compile(rb"PK\x03\x04"), (".npz",), _whole(read_npz)),
    # Text begins like nothing in particular, so here the extension decides too.
    Format("text", _TEXT_START, (".xyz", ".csv", ".tsv", ".txt", ".asc", ".pts"), read_text),
)
_ACCEPTED = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in FORMATS)
_HEAD_BYTES = 1 << 16


def detect(path: PurePath, data: bytes) -> tuple[Format, tuple[str, ...]]:
    """Return the format of a file and a warning where its name says another.

    Raises
    ------
    DivespotError
        If neither content nor extension is that of an accepted format.
    """
    head = data[:_HEAD_BYTES]
    extension = path.suffix.lower()
    by_name = next((f for f in FORMATS if extension in f.extensions), None)
    *binary, text = FORMATS
    found = next((f for f in binary if f.begins.match(head)), None)
    if found is None and by_name is text and text.begins.match(head):
        found = text
    if found is None:
        claim = f"is no {by_name.name} file inside" if by_name else "is in no known format"
        raise DivespotError(f"it {claim}: one of {_ACCEPTED} is needed")
    if by_name in (found, None):
        return found, ()
    return found, (f"the file is called {extension} but is {found.name}, and was read as that",)
