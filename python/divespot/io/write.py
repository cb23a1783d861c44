"""Writing points to a file."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

# Steps of LAS coordinates: finer than any scanner, and 32 bits of them span 214 km.
_LAS_SCALE_M = 1e-4
# GeoKeys: version 1.1.0, one key, ProjLinearUnits = metre.
_LAS_METRES = struct.pack("<8H", 1, 1, 0, 1, 3076, 0, 1, 9001)


def write(path: str | os.PathLike[str], points: ArrayLike) -> None:
    """Write points in metres; the extension decides the format.

    Parameters
    ----------
    path : str or os.PathLike
        ``.ply`` (binary little endian), ``.npy``, ``.xyz``, ``.las`` or ``.laz``.
    points : array_like, shape (n, 3)
        float32 is written as such, all else as float64. LAS and LAZ round to 0.1 mm and state
        metres; the other formats state no unit.

    Raises
    ------
    DivespotError
        If the shape, the extension or the folder is not as needed, or LAS cannot hold a value.
    """
    xyz = np.asarray(points)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or xyz.dtype.kind not in "iuf":
        raise DivespotError(f"points are {xyz.dtype} of shape {xyz.shape}: need numbers of (n, 3)")
    if xyz.dtype != np.float32:
        xyz = xyz.astype(np.float64)
    target = Path(path)
    writer = _WRITERS.get(target.suffix.lower())
    if writer is None:
        raise DivespotError(f"{target}: unknown extension, need one of {', '.join(_WRITERS)}")
    try:
        writer(target, xyz)
    except OSError as err:
        raise DivespotError(f"{target}: cannot be written ({err.strerror})") from None


def _write_ply(path: Path, xyz: NDArray[Any]) -> None:
    kind = "float" if xyz.dtype == np.float32 else "double"
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(xyz)}"]
    header += [f"property {kind} {axis}" for axis in "xyz"]
    body = np.ascontiguousarray(xyz, dtype=xyz.dtype.newbyteorder("<")).tobytes()
    path.write_bytes("\n".join([*header, "end_header\n"]).encode() + body)


def _write_npy(path: Path, xyz: NDArray[Any]) -> None:
    # An open file, since numpy.save would add an extension to a name like 'SCAN.NPY'.
    with path.open("wb") as stream:
        np.save(stream, np.ascontiguousarray(xyz))


def _write_xyz(path: Path, xyz: NDArray[Any]) -> None:
    # As many digits as it takes to read back the same float64.
    np.savetxt(path, xyz, fmt="%.17g")


def _write_las(path: Path, xyz: NDArray[Any]) -> None:
    import laspy  # noqa: PLC0415  (import divespot stays light)

    if not np.isfinite(xyz).all():
        raise DivespotError(f"{path}: LAS cannot hold nan or inf, need finite points")
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales = np.full(3, _LAS_SCALE_M)
    header.offsets = np.floor(xyz.min(axis=0)) if len(xyz) else np.zeros(3)
    if len(xyz) and (np.ptp(xyz, axis=0) > _LAS_SCALE_M * (2**31 - 1)).any():
        raise DivespotError(f"{path}: LAS cannot span over {_LAS_SCALE_M * 2**31:.0f} m at 0.1 mm")
    header.vlrs.append(laspy.VLR("LASF_Projection", 34735, "GeoKeys", _LAS_METRES))
    las = laspy.LasData(header)
    las.xyz = xyz.astype(np.float64)
    las.write(str(path))


_WRITERS: dict[str, Callable[[Path, NDArray[Any]], None]] = {
    ".ply": _write_ply,
    ".npy": _write_npy,
    ".xyz": _write_xyz,
    ".las": _write_las,
    ".laz": _write_las,
}
