"""The bytes of a regular file."""

from __future__ import annotations

import os
import stat
from typing import TYPE_CHECKING

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from pathlib import Path


def bytes_of(file: Path, most: int | None = None) -> bytes:
    """Return the content of a regular file.

    Parameters
    ----------
    file
    most
        Largest size in bytes; None: the memory of this machine.

    Raises
    ------
    DivespotError
        The path is not a regular file, or the file is empty or too large.
    OSError
        The file cannot be read.

    """
    require_regular(file, most)
    data = file.read_bytes()
    if not data:
        raise DivespotError("the file is empty: one with data is needed")
    return data


def require_regular(file: Path, most: int | None = None) -> None:
    """Raise the errors of `bytes_of` for a path that is no regular file, or a file too large."""
    try:
        found = file.stat()
    except ValueError as err:
        raise DivespotError(f"is no path ({err}): the name of a file is needed") from None
    if stat.S_ISDIR(found.st_mode):
        raise DivespotError(
            "is a folder: a file is needed, or intrinsics where it holds depth frames"
        )
    # A pipe or device may never end.
    if not stat.S_ISREG(found.st_mode):
        raise DivespotError("is no regular file: one is needed")
    limit = _memory_bytes() if most is None else most
    if found.st_size > limit:
        raise DivespotError(f"has {found.st_size >> 20} MB: at most {limit >> 20} MB are needed")


def _memory_bytes() -> int:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # not supported on every system
        return 1 << 62
