"""Detection of file formats."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot.errors import DivespotError
from divespot.io import esri_grid, mesh, ptx, raster
from divespot.io.e57 import read_e57
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
    """A file format: how its files begin, their extensions, and the function that reads them.

    Files of a format known `by_name` have no distinctive beginning: their extension must match
    too.
    """

    name: str
    begins: re.Pattern[bytes]
    extensions: tuple[str, ...]
    read: Callable[[bytes, Wanted], RawCloud]
    by_name: bool = False


def _whole(read: Callable[[bytes], RawCloud]) -> Callable[[bytes, Wanted], RawCloud]:
    """Return a reader for a format without options."""

    def read_all(data: bytes, wanted: Wanted) -> RawCloud:
        wanted.refuse_columns()
        return read(data)

    return read_all


def _raster(driver: str) -> Callable[[bytes, Wanted], RawCloud]:
    """Return a reader of rasters, which can be limited to a rectangle."""
    read = raster.reader(driver)

    def read_window(data: bytes, wanted: Wanted) -> RawCloud:
        wanted.refuse_columns()
        return read(data, wanted)

    return read_window


_COMMENT_LINES = rb"(?:[ \t]*(?:#[^\r\n]*)?[\r\n])*[ \t]*"
# Text without a NUL byte; or UTF-16, which contains them, recognized by its byte order mark.
_TEXT_START = re.compile(rb"\xff\xfe|\xfe\xff|[^\0]*\Z")
# Text, or 80 bytes and a count.
_STL_START = re.compile(rb"\s*solid\s|[\0-\xff]{84}")
FORMATS = (
    Format("PLY", re.compile(rb"\s*ply[ \t]*[\r\n]"), (".ply",), _whole(read_ply)),
    Format(
        "PCD",
        re.compile(_COMMENT_LINES + rb"(VERSION|FIELDS|COLUMNS)\s"),
        (".pcd",),
        _whole(read_pcd),
    ),
    Format("LAS/LAZ", re.compile(rb"LASF"), (".las", ".laz"), read_las),
    Format("E57", re.compile(rb"ASTM-E57"), (".e57",), _whole(read_e57)),
    Format("PTX", ptx.BEGINS, (".ptx",), _whole(ptx.read_ptx)),
    Format("NPY", re.compile(rb"\x93NUMPY"), (".npy",), _whole(read_npy)),
    Format("NPZ", re.compile(rb"PK\x03\x04"), (".npz",), _whole(read_npz)),
    Format(
        "GeoTIFF",
        re.compile(rb"II[*+]\0|MM\0[*+]"),
        (".tif", ".tiff"),
        _raster("GTiff"),
    ),
    Format("Erdas Imagine", re.compile(rb"EHFA_HEADER"), (".img",), _raster("HFA")),
    Format("ESRI grid", esri_grid.BEGINS, (".asc",), _whole(esri_grid.read_esri)),
    Format("GLB", re.compile(rb"glTF"), (".glb",), _whole(mesh.reader("glb", "m"))),
    Format("STL", _STL_START, (".stl",), _whole(mesh.reader("stl")), by_name=True),
    Format("OBJ", _TEXT_START, (".obj",), _whole(mesh.reader("obj")), by_name=True),
    Format(
        *("text", _TEXT_START, (".xyz", ".csv", ".tsv", ".txt", ".asc", ".pts"), read_text),
        by_name=True,
    ),
)
_ACCEPTED = ", ".join(f"{f.name} ({' '.join(f.extensions)})" for f in FORMATS)
_HEAD_BYTES = 1 << 16


def detect(path: PurePath, data: bytes) -> tuple[Format, tuple[str, ...]]:
    """Return the format of a file, and a warning if its name says another.

    Raises
    ------
    DivespotError
        Neither content nor extension is that of an accepted format.
    """
    head = data[:_HEAD_BYTES]
    extension = path.suffix.lower()
    named = [f for f in FORMATS if extension in f.extensions]
    fitting = [f for f in FORMATS if f.begins.match(head) and (f in named or not f.by_name)]
    if not fitting:
        claim = f"is no {named[-1].name} file inside" if named else "is in no known format"
        raise DivespotError(f"it {claim}: one of {_ACCEPTED} is needed")
    found = fitting[0]
    if found in named or not named:
        return found, ()
    return found, (f"the file is called {extension} but is {found.name}, and was read as that",)
