"""Scans from files, points to files.

Formats: PLY, PCD, LAS, LAZ, text (xyz, csv, tsv, txt, asc, pts), NPY, NPZ.
"""

from __future__ import annotations

import os
import stat
import warnings as python_warnings
from pathlib import Path

import numpy as np

from divespot.errors import DivespotError
from divespot.io.formats import detect
from divespot.io.scan import FloatArray, RawCloud, Scan
from divespot.io.units import DEGREES, UNITS, accepted_units, metres_per
from divespot.io.write import write

__all__ = ["UNITS", "Scan", "read", "write"]


def read(path: str | os.PathLike[str], *, unit: str = "auto") -> Scan:
    """Read a scan, whatever its format, in metres.

    The format follows from the content; a file with another's extension is read with a warning.
    No point is dropped.

    Parameters
    ----------
    path : str or os.PathLike
        PLY (ascii, both binaries), PCD (ascii, binary, binary_compressed), LAS, LAZ, COPC; NPY or
        NPZ of shape (n, >=3), (h, w, >=3) or with fields x, y, z; or lines of text.
    unit : str
        The unit of the file's numbers, a key of `UNITS`, over whatever the file says. ``"auto"``
        takes what the file states, and metres where it states nothing.

    Returns
    -------
    Scan

    Raises
    ------
    DivespotError
        If there is no such file, it is not readable, damaged, without points or in no accepted
        format, if `unit` is unknown, or if the file is in degrees.
    """
    if unit != "auto":
        metres_per(unit)
    file = Path(os.fsdecode(path))
    try:
        return _read(file, unit)
    except DivespotError as err:
        # What a library says may take several lines.
        raise DivespotError(f"{file}: {' '.join(str(err).split())}") from None
    except OSError as err:
        raise DivespotError(f"{file}: cannot be read ({err.strerror or err})") from None
    except MemoryError:
        raise DivespotError(f"{file}: too large for the memory there is") from None


def _read(file: Path, unit: str) -> Scan:
    data = _bytes_of(file)
    found, warnings = detect(file, data)
    # What a library has to say about a file belongs to the scan, not to the process.
    with python_warnings.catch_warnings(record=True) as caught:
        python_warnings.simplefilter("always")
        raw = found.read(data)
    if len(raw.xyz) == 0:
        raise DivespotError("it holds 0 points")
    said = dict.fromkeys(str(warning.message) for warning in caught)
    unit_used, points, unit_warnings = _in_metres(raw, unit)
    return Scan(
        points=points,
        path=str(file),
        unit=unit_used,
        unit_stated=unit != "auto" or raw.unit is not None,
        crs=raw.crs,
        warnings=(*warnings, *raw.warnings, *said, *unit_warnings),
        projected=raw.projected,
        viewpoint_m=_place(raw, unit_used),
        raster=raw.raster,
    )


def _place(raw: RawCloud, unit: str) -> tuple[float, float, float] | None:
    if raw.viewpoint is None:
        return None
    x, y, z = raw.viewpoint
    return x * UNITS[unit], y * UNITS[unit], z * UNITS[unit]


def _bytes_of(file: Path) -> bytes:
    try:
        mode = file.stat().st_mode
    except ValueError as err:
        raise DivespotError(f"is no path ({err})") from None
    if stat.S_ISDIR(mode):
        raise DivespotError("is a folder, need a file")
    # A pipe or device may never end.
    if not stat.S_ISREG(mode):
        raise DivespotError("is no regular file")
    data = file.read_bytes()
    if not data:
        raise DivespotError("the file is empty")
    return data


def _in_metres(raw: RawCloud, asked: str) -> tuple[str, FloatArray, tuple[str, ...]]:
    """Return the unit of the file's numbers, its points in metres, and warnings."""
    if asked != "auto":
        differs = raw.unit not in (None, asked)
        warning = f"the file says its unit is {raw.unit}, it was read as {asked} as asked"
        return asked, _scaled(raw.xyz, asked, asked), (warning,) if differs else ()
    unit = raw.unit or "m"
    vertical = raw.vertical_unit or unit
    if unit == DEGREES:
        raise DivespotError(
            "its coordinates are degrees: project it to metres first, or give its unit"
        )
    for stated in (unit, vertical):
        if stated not in UNITS:
            raise DivespotError(f"its unit is {stated!r}: give one of {accepted_units()}")
    warning = f"x and y are in {unit}, z in {vertical}"
    warnings = (warning,) if vertical != unit else ()
    return unit, _scaled(raw.xyz, unit, vertical), warnings


def _scaled(xyz: FloatArray, unit: str, vertical: str) -> FloatArray:
    factors = np.array([metres_per(unit), metres_per(unit), metres_per(vertical)])
    if (factors == 1.0).all():
        return xyz
    # Garbage near the largest float may overflow to inf, which a later stage drops and counts.
    with np.errstate(over="ignore", invalid="ignore"):
        scaled: FloatArray = xyz * factors
    return scaled
