"""Writing points to a file."""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from divespot._arguments import as_floats
from divespot.errors import DivespotError
from divespot.output import other_ending, whole

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

#: A later run recognizes its own files by this; see `divespot.output.POINTS`.
MARK = "written by divespot"

# Step of LAS coordinates in metres: finer than any scanner, and 32 bits of them span 214 km.
_LAS_SCALE_M = 1e-4
# GeoKeys: version 1.1.0, one key, ProjLinearUnits = metre.
_LAS_METRES = struct.pack("<8H", 1, 1, 0, 1, 3076, 0, 1, 9001)


def write(path: str | os.PathLike[str], points: ArrayLike) -> None:
    """Write points in metres, in the format of the extension.

    The file is written whole or not at all.

    Parameters
    ----------
    path : str or os.PathLike
        ``.ply`` (binary little endian), ``.npy``, ``.xyz``, ``.las`` or ``.laz``.
    points : array_like, shape (n, 3)
        float32 is written as float32, anything else as float64. LAS and LAZ round to 0.1 mm and
        state metres; the other formats state no unit.

    Raises
    ------
    DivespotError
        The shape, the extension or the folder is invalid, or LAS cannot hold a value.

    Examples
    --------
    >>> from divespot import io
    >>> io.write("scan.ply", [[0.0, 0.0, 1.0], [0.0, 1.0, 2.0]])
    >>> len(io.read("scan.ply").points)
    2

    """
    xyz = as_floats("points", points)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or xyz.dtype.kind not in "iuf":
        raise DivespotError(
            f"points are {xyz.dtype} of shape {xyz.shape}: numbers of shape (n, 3) are needed"
        )
    if xyz.dtype != np.float32:
        xyz = xyz.astype(np.float64)
    require_writable(path)
    try:
        with whole(path) as stream:
            _WRITERS[PurePath(path).suffix.lower()](stream, xyz)
    except _UnfitError as err:
        raise DivespotError(f"{path}: {err}") from None


def require_writable(path: str | os.PathLike[str]) -> None:
    """Raise DivespotError if the extension is not one of those that can be written."""
    if PurePath(path).suffix.lower() not in _WRITERS:
        raise other_ending(path, "points", _WRITERS)


class _UnfitError(DivespotError):
    """Points that a format cannot hold."""


def _write_ply(stream: BinaryIO, xyz: NDArray[Any]) -> None:
    kind = "float" if xyz.dtype == np.float32 else "double"
    header = ["ply", "format binary_little_endian 1.0", f"comment {MARK}"]
    header += [f"element vertex {len(xyz)}"]
    header += [f"property {kind} {axis}" for axis in "xyz"]
    body = np.ascontiguousarray(xyz, dtype=xyz.dtype.newbyteorder("<")).tobytes()
    stream.write("\n".join([*header, "end_header\n"]).encode() + body)


def _write_npy(stream: BinaryIO, xyz: NDArray[Any]) -> None:
    np.save(stream, np.ascontiguousarray(xyz))


def _write_xyz(stream: BinaryIO, xyz: NDArray[Any]) -> None:
    # As many digits as are needed to read back the same float64.
    np.savetxt(stream, xyz, fmt="%.17g")


def _write_laz(stream: BinaryIO, xyz: NDArray[Any]) -> None:
    _write_las(stream, xyz, compress=True)


def _write_las(stream: BinaryIO, xyz: NDArray[Any], *, compress: bool = False) -> None:
    import laspy  # noqa: PLC0415  (import divespot stays light)

    if not np.isfinite(xyz).all():
        raise _UnfitError("LAS cannot hold nan or inf: finite points are needed")
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.generating_software = "divespot"
    header.scales = np.full(3, _LAS_SCALE_M)
    header.offsets = np.floor(xyz.min(axis=0)) if len(xyz) else np.zeros(3)
    span_m = np.ptp(xyz, axis=0).max() if len(xyz) else 0.0
    if span_m > _LAS_SCALE_M * (2**31 - 1):
        most_m = _LAS_SCALE_M * 2**31
        raise _UnfitError(
            f"the points span {span_m:.0f} m: at most {most_m:.0f} m is needed in LAS"
        )
    header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "GeoKeys", _LAS_METRES))
    las = laspy.LasData(header)
    las.xyz = xyz.astype(np.float64)
    # If laspy closed it, the file could not be renamed; and a LAZ writer seeks back.
    held = BytesIO()
    las.write(held, do_compress=compress)
    stream.write(held.getvalue())


_WRITERS: dict[str, Callable[[BinaryIO, NDArray[Any]], None]] = {
    ".ply": _write_ply,
    ".npy": _write_npy,
    ".xyz": _write_xyz,
    ".las": _write_las,
    ".laz": _write_laz,
}
