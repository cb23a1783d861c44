"""Points as fixed-size binary records."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError
from divespot.io.scan import FloatArray, stack

if TYPE_CHECKING:
    from collections.abc import Mapping


def require_axes(names: Mapping[str, object], what: str) -> None:
    """Raise DivespotError unless `names` holds x, y and z."""
    missing = [axis for axis in "xyz" if axis not in names]
    if missing:
        found = ", ".join(names) or "none"
        raise DivespotError(f"no {', '.join(missing)} among its {what} ({found}): need x, y and z")


def require_bytes(needed: int, held: int, count: int) -> None:
    """Raise DivespotError where a header promises more than the file holds.

    Called before anything of that size is allocated.
    """
    if needed > held:
        raise DivespotError(
            f"the header promises {count} points ({needed} bytes) but the file holds "
            f"{max(held, 0)} bytes of them: it is truncated or corrupt"
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
        NumPy type, with byte order, and byte offset inside the record, for at least x, y, z.

    Returns
    -------
    ndarray, shape (count, 3), float64
    """
    require_bytes(count * stride, len(data) - offset, count)
    formats, offsets = zip(*(fields[axis] for axis in "xyz"), strict=True)
    dtype = np.dtype(
        {"names": ["x", "y", "z"], "formats": formats, "offsets": offsets, "itemsize": stride}
    )
    records = np.frombuffer(data, dtype, count, offset)
    return stack([records[axis] for axis in "xyz"])
