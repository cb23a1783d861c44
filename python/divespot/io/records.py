"""Points as fixed-size binary records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError, damaged
from divespot.io.scan import FloatArray, stack

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


#: A table wider than 64 columns is an image; so is one of 16 or more columns that is less than four
#: times as high as wide.
_IMAGE_COLUMNS, _TABLE_COLUMNS, _TALL = 16, 64, 4


def axes_of(names: Iterable[str], what: str) -> tuple[str, str, str]:
    """Return which of `names` are x, y and z, in lower case or, if there are none, in capitals.

    Raises
    ------
    DivespotError
        One of x, y, z is missing.

    """
    known = list(names)
    found = [next((name for name in (a, a.upper()) if name in known), None) for a in "xyz"]
    x, y, z = found
    if x is None or y is None or z is None:
        missing = ", ".join(a for a, name in zip("xyz", found, strict=True) if name is None)
        listed = ", ".join(known) or "none"
        raise DivespotError(f"no {missing} among its {what} ({listed}): x, y and z are needed")
    return x, y, z


def refuse_image(rows: int, columns: int) -> None:
    """Raise DivespotError if a table is as wide as only images are."""
    if rows == 3 and columns > _TABLE_COLUMNS:
        raise DivespotError(
            f"it holds 3 rows of {columns} numbers: one row per point (transposed) is needed"
        )
    if columns > _TABLE_COLUMNS or (columns >= _IMAGE_COLUMNS and rows < _TALL * columns):
        raise DivespotError(
            f"it holds {rows} rows of {columns} numbers, as a depth image does: rows of x, y, z "
            "are needed (depths z become points by the camera's x = (u - cx) z / fx, "
            "y = (v - cy) z / fy)"
        )


def require_bytes(needed: int, held: int, count: int) -> None:
    """Raise DivespotError if a header promises more than the file holds.

    Called before anything of that size is allocated.
    """
    if needed > held:
        raise damaged(
            f"the header promises {count} points ({needed} bytes) but the file holds "
            f"{max(held, 0)} bytes of them"
        )


def unpack_records(
    data: bytes, offset: int, count: int, fields: Mapping[str, tuple[str, int]], stride: int
) -> FloatArray:
    """Return x, y, z of `count` records of `stride` bytes that begin at byte `offset`.

    Parameters
    ----------
    data : bytes
    offset, count, stride : int
    fields : mapping of str to (str, int)
        For at least x, y, z: NumPy type, with byte order, and byte offset inside the record.

    Returns
    -------
    ndarray, shape (count, 3), float64
    """
    require_bytes(count * stride, len(data) - offset, count)
    if count == 0:
        return np.empty((0, 3))
    axes = axes_of(fields, "fields")
    formats, offsets = zip(*(fields[axis] for axis in axes), strict=True)
    dtype = np.dtype(
        {"names": ["x", "y", "z"], "formats": formats, "offsets": offsets, "itemsize": stride}
    )
    records = np.frombuffer(data, dtype, count, offset)
    return stack([records[axis] for axis in "xyz"])
