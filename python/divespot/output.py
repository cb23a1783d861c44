"""Files written whole or not at all, and never over files of other programs."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from divespot.errors import DivespotError, unwritable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from io import FileIO

#: Patterns at the beginning or end of files that divespot has written.
REPORT = re.compile(rb'\s*\{.{0,2000}?"schema": "divespot\.', re.DOTALL)
PICTURE = re.compile(
    rb"\x89PNG.{0,2000}?divespot|<\?xml.{0,2000}?divespot|%PDF-.*written by divespot\n\Z", re.DOTALL
)
OUTLINES = re.compile(rb'\s*\{\s*"type": "FeatureCollection",\s*"generator": "divespot"')
POINTS = re.compile(rb"ply\n.{0,200}?comment written by divespot\n|LASF.{54}divespot", re.DOTALL)
PAGE = re.compile(
    rb"<!doctype html>\n<!-- written by divespot|%PDF-.*written by divespot\n\Z", re.DOTALL
)
#: The application id in the header of a SQLite file.
HISTORY = re.compile(rb"SQLite format 3\0.{52}dvsp", re.DOTALL)
GEOPACKAGE = re.compile(rb"SQLite format 3\0.{52}GPKG.*written by divespot", re.DOTALL)
POSES = re.compile(rb"# written by divespot: time ")
DEM = re.compile(rb"(II\*\0|MM\0\*).*written by divespot", re.DOTALL)
TABLE = re.compile(rb"time,scan,scan_unit,")
#: Number of bytes at a file's beginning and end that are examined.
_HEAD_BYTES, _TAIL_BYTES = 32768, 4096


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file that gets its name only once it is complete.

    Until then it has another name in the same folder, so that after a full disk or a killed process
    the previous file is still there. A device or a pipe is written directly.

    Yields
    ------
    stream

    Raises
    ------
    DivespotError
        The file cannot be written.

    """
    try:
        target = Path(os.path.realpath(path))
    except ValueError as error:
        raise DivespotError(f"{path}: is no path ({error}): the name of a file is needed") from None
    beside = target.with_name(f".{target.name[:100]}.{secrets.token_hex(4)}.part")
    try:
        if target.exists() and not target.is_file():
            with target.open("wb") as stream:
                yield stream
            return
        with beside.open("xb") as stream:
            yield stream
        if target.exists():
            shutil.copymode(target, beside)
        beside.replace(target)
    except OSError as error:
        raise unwritable(path, error) from None
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file as a whole."""
    with whole(path) as stream:
        stream.write(text.encode())


def append_line(path: str | os.PathLike[str], line: str) -> None:
    """Append a line to a file, whole or not at all.

    Raises
    ------
    DivespotError
        The file cannot be written.

    """
    try:
        with Path(path).open("a+b", buffering=0) as file:
            size = file.seek(0, os.SEEK_END) if file.seekable() else 0
            data = _line_end(file, size) + line.encode()
            if file.write(data) != len(data):
                file.truncate(size)
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))  # noqa: TRY301
    except (OSError, ValueError) as error:
        raise unwritable(path, error) from None


def other_ending(path: str | os.PathLike[str], what: str, endings: Iterable[str]) -> DivespotError:
    """Return the error of a name that has not the ending of a format."""
    return DivespotError(f"{path}: one of {', '.join(endings)} is needed as the ending of {what}")


def _line_end(file: FileIO, size: int) -> bytes:
    """Return the line end that is missing if an earlier process was killed."""
    if size == 0:
        return b""
    file.seek(size - 1)
    return b"" if file.read(1) == b"\n" else b"\n"


def require_own(
    path: str | os.PathLike[str], kind: re.Pattern[bytes], what: str, *, force: bool = False
) -> None:
    """Raise DivespotError if the file exists and is not one that divespot writes as `what`."""
    try:
        if force or not Path(path).is_file():
            return
        with Path(path).open("rb") as stream:
            head = stream.read(_HEAD_BYTES)
            size = stream.seek(0, os.SEEK_END)
            stream.seek(max(size - _TAIL_BYTES, len(head)))
            ends = head + stream.read()
    except (OSError, ValueError) as error:
        raise unwritable(path, error) from None
    if ends and not kind.match(ends):
        raise DivespotError(
            f"{path}: {what} would overwrite this file, which divespot did not write as such: "
            "another name, or --force, is needed"
        )


def refuse_inputs(
    path: str | os.PathLike[str], what: str, inputs: Iterable[str | os.PathLike[str] | None]
) -> None:
    """Raise DivespotError if the file to be written is one of the inputs."""
    for source in inputs:
        if source is not None and _same(path, source):
            raise DivespotError(f"{path}: {what} would overwrite an input: another name is needed")


def _same(one: str | os.PathLike[str], other: str | os.PathLike[str]) -> bool:
    try:
        return Path(one).samefile(other)
    except (OSError, ValueError):
        pass
    with suppress(ValueError):  # an invalid path is no input either
        return os.path.realpath(one) == os.path.realpath(other)
    return False
