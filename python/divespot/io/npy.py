"""NPY and NPZ, without pickled objects."""

from __future__ import annotations

import math
from io import BytesIO
from typing import TYPE_CHECKING, Any

from numpy.lib import format as npy_format

from divespot.errors import DivespotError, damaged
from divespot.io.packed import open_zip, read_member
from divespot.io.records import axes_of, refuse_image, require_bytes
from divespot.io.scan import RawCloud, stack

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_POINTS_KEYS = ("points", "xyz", "arr_0")
# Axes of an array of pixels, with x, y and z along the last axis or as fields.
_PIXEL_AXES, _PIXEL_AXES_OF_FIELDS = 3, 2
_SHAPES = "(n, 3 or more), (h, w, 3 or more), or a structured array with fields x, y, z"


def read_npy(data: bytes) -> RawCloud:
    """Read an (n, >=3), (h, w, >=3) or structured x, y, z array."""
    return _raw(_load(data))


def read_npz(data: bytes) -> RawCloud:
    """Read the array named points, xyz or arr_0, or else the only one; or arrays x, y, z.

    Other arrays are not read: they may be pickled.
    """
    with open_zip(data) as archive:
        members = {m.filename[:-4]: m for m in archive.infolist() if m.filename.endswith(".npy")}
        arrays = [_load(read_member(archive, members[name])) for name in _chosen(list(members))]
    return _raw(arrays[0]) if len(arrays) == 1 else RawCloud(_columns(arrays))


def _raw(array: NDArray[Any]) -> RawCloud:
    """Return an array's points; an array of pixels has a raster."""
    axes = _PIXEL_AXES if array.dtype.names is None else _PIXEL_AXES_OF_FIELDS
    pixels = array.ndim == axes and min(array.shape[:2]) > 1
    return RawCloud(_xyz(array), raster=array.shape[:2] if pixels else None)


def _chosen(names: list[str]) -> list[str]:
    """Return the name of the array that holds the points, or the three names of x, y and z."""
    for axes in (["x", "y", "z"], ["X", "Y", "Z"]):
        if all(axis in names for axis in axes):
            return axes
    named = [key for key in _POINTS_KEYS if key in names]
    if not named and len(names) != 1:
        raise DivespotError(
            f"it holds the arrays {', '.join(names) or 'none'}: one array, or one named "
            f"{', '.join(_POINTS_KEYS)}, or x, y and z are needed"
        )
    return named[:1] or names


def _load(data: bytes) -> NDArray[Any]:
    try:
        _check_size(data)
        array: NDArray[Any] = npy_format.read_array(BytesIO(data), allow_pickle=False)
    except DivespotError:
        raise
    # The header is a Python literal; NumPy passes on any exception of its parser.
    except Exception as err:  # noqa: BLE001
        raise damaged(f"not a readable NPY array ({err})") from None
    return array


def _check_size(data: bytes) -> None:
    """Compare the header with the bytes that follow it; raises NumPy's errors on bad headers."""
    stream = BytesIO(data)
    version = npy_format.read_magic(stream)
    # Version 3 differs from 2 only in the encoding of field names.
    parse = (
        npy_format.read_array_header_1_0 if version[0] == 1 else npy_format.read_array_header_2_0
    )
    shape, _, dtype = parse(stream)
    if dtype.hasobject:
        raise DivespotError("it holds pickled Python objects: an array of numbers is needed")
    require_bytes(math.prod(shape) * dtype.itemsize, len(data) - stream.tell(), math.prod(shape))


def _xyz(array: NDArray[Any]) -> NDArray[np.float64]:
    if array.dtype.names is not None:
        return _columns([array[axis] for axis in axes_of(array.dtype.names, "fields")])
    if array.ndim not in (2, 3) or array.shape[-1] < 3:
        raise DivespotError(f"it holds an array of shape {array.shape}: shape {_SHAPES} is needed")
    if array.ndim == 3 and array.dtype.itemsize == 1:
        raise DivespotError(
            f"it holds {array.shape[-1]} bytes a pixel, a picture: shape {_SHAPES} is needed"
        )
    flat = _real(array).reshape(-1, array.shape[-1])
    refuse_image(*flat.shape)
    return stack([flat[:, axis] for axis in range(3)])


def _columns(arrays: list[NDArray[Any]]) -> NDArray[np.float64]:
    columns = [_real(array).ravel() for array in arrays]
    if len({len(column) for column in columns}) != 1:
        raise DivespotError("its arrays x, y and z differ in size: one size is needed")
    return stack(columns)


def _real(array: NDArray[Any]) -> NDArray[Any]:
    if array.dtype.kind not in "iuf":
        raise DivespotError(f"it holds {array.dtype} values: real numbers are needed")
    return array
