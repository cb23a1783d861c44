"""Reading scans from files, and writing points to files.

Formats: PLY, PCD, LAS, LAZ, E57, PTX, text (xyz, csv, tsv, txt, asc, pts), NPY, NPZ; rasters of
heights (GeoTIFF, Erdas Imagine, ESRI grid), meshes (OBJ, STL, GLB, PLY with faces); each also
in a GZIP or ZIP file.
"""

from __future__ import annotations

import os
import warnings as python_warnings
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError, NothingSeenError, unreadable
from divespot.io.doubts import Judged, doubts_of, judged
from divespot.io.files import bytes_of
from divespot.io.formats import detect
from divespot.io.given_system import with_system
from divespot.io.las_sample import begins_as_las, sample_las
from divespot.io.merge import are_paths, merged
from divespot.io.packed import unpacked
from divespot.io.scan import FloatArray, RawCloud, Scan
from divespot.io.steps import steps
from divespot.io.units import DEGREES, STRETCHED, UNITS, accepted_units, metres_per
from divespot.io.wanted import Wanted
from divespot.io.web import is_url, read_url
from divespot.io.write import write

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.io.wanted import Plan

__all__ = ["UNITS", "Scan", "read", "sample", "write"]


def read(  # noqa: PLR0913 - one argument an option
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    unit: str = "auto",
    crs: str | None = None,
    columns: str | None = None,
    classes: str | None = None,
    returns: str = "all",
    plan: Sequence[float] | Plan | None = None,
) -> Scan:
    """Read a scan, whatever its format, in metres.

    The format is detected from the content; if the extension is another format's, a warning is
    given. No points are dropped except those of LAS files that are withheld, noise or not wanted.

    Parameters
    ----------
    path : str or os.PathLike, or a list of these
        Several files are merged into one survey; they must have one unit and reference system.
        PLY (ascii, both binaries), PCD (ascii, binary, binary_compressed), LAS, LAZ, COPC, E57
        and PTX (all scans of a file, in its common frame); NPY or NPZ of shape (n, >=3),
        (h, w, >=3) or with fields x, y, z; GeoTIFF, IMG or ESRI grid, read as the centres of their
        cells; OBJ, STL, GLB or PLY with faces, sampled over their surface; or lines of text. Any of
        them in a GZIP file or alone in a ZIP file. Of a COPC file at ``http://`` or ``https://``,
        only the points inside `plan` are fetched, by range requests.
    unit : str
        The unit of the file's numbers, a key of `UNITS`, which overrides the file's own. ``"auto"``
        uses the unit that the file states, or metres if it states none.
    crs : str or None
        The reference system, ``"EPSG:CODE"`` or WKT, of a file that states none; needs pyproj.
    columns : str or None
        Columns of x, y and z in a table of text, such as ``"3,2,4"`` or ``"Easting,North,H"``.
    classes : str or None
        Classes of a LAS file to keep, such as ``"2,6"``; None keeps all except noise.
    returns : str
        Returns of a LAS file to keep: ``"all"``, ``"first"`` or ``"last"``.
    plan : sequence of float, callable or None
        x0, y0, x1, y1 in the file's numbers, or what tells them from its reference system and a
        place in it: of a COPC file, no point outside is read.

    Returns
    -------
    Scan

    Raises
    ------
    DivespotError
        If the file does not exist, is unreadable, damaged, without points or in an unknown format;
        if `unit` is unknown, or the file is in degrees or another unit that is not a length; or if
        several files disagree on unit or reference system.

    Examples
    --------
    >>> from divespot import io
    >>> io.write("scan.xyz", [[0.0, 0.0, 1.0], [0.0, 1.0, 2.0]])
    >>> io.read("scan.xyz", unit="ft").points[:, 2].round(4).tolist()
    [0.3048, 0.6096]

    """
    if not isinstance(unit, str) or unit != "auto":
        metres_per(unit)
    wanted = Wanted.of(columns, classes, returns, crs, plan)
    if are_paths(path):
        return merged([_named(_place_of(one), unit, wanted) for one in path])
    return _named(_place_of(path), unit, wanted)  # type: ignore[arg-type]  # no list of paths


def _place_of(path: str | os.PathLike[str]) -> Path | str:
    """Return a path, or the address of a file on a server."""
    return str(path) if is_url(path) else Path(os.fsdecode(path))


def _named(file: Path | str, unit: str, wanted: Wanted) -> Scan:
    """Read a file, and put its name in front of errors."""
    try:
        return _read(file, unit, wanted)
    except DivespotError as err:
        raise type(err)(f"{file}: {err}") from None
    except OSError as err:
        raise unreadable(file, err) from None
    except MemoryError:
        raise DivespotError(
            f"{file}: is too large for the memory there is: a smaller file, or a crop, is needed"
        ) from None


def sample(path: str | os.PathLike[str], *, unit: str = "auto") -> Scan:
    """Read a scan, or a sample of its points if it is a large LAS or LAZ file.

    Otherwise like `read`; `Scan.whole` holds what the file states about all its points.

    Examples
    --------
    >>> from divespot import io
    >>> io.write("scan.xyz", [[0.0, 0.0, 1.0], [0.0, 1.0, 2.0]])
    >>> len(io.sample("scan.xyz").points)
    2

    """
    if not isinstance(unit, str) or unit != "auto":
        metres_per(unit)
    return _named(_place_of(path), unit, Wanted(some=True))


def stretches(
    path: str | os.PathLike[str], count: int, *, unit: str = "auto", crs: str | None = None
) -> Scan:
    """Read `count` stretches of a LAS or LAZ file, with points of any class."""
    return _named(_place_of(path), unit, Wanted(crs=crs, some=True, stretches=count))


def _read(file: Path | str, unit: str, wanted: Wanted) -> Scan:
    # Warnings of a library about a file belong to the scan, not to the process.
    with python_warnings.catch_warnings(record=True) as caught:
        python_warnings.simplefilter("always")
        name, raw, warnings = _raw(file, wanted)
    if len(raw.xyz) == 0:
        raise NothingSeenError("it holds 0 points: some are needed")
    said = dict.fromkeys(str(warning.message) for warning in caught)
    raw = with_system(raw, wanted.crs)
    unit_used, vertical, unit_warnings = _units(raw, unit)
    stated = unit != "auto" or raw.unit is not None
    seen = _judged(raw, unit_used, wanted, stated=stated)
    factors = np.array([metres_per(unit_used)] * 2 + [metres_per(vertical)])
    return Scan(
        points=_scaled(seen.xyz, factors),
        path=str(file),
        unit=unit_used,
        unit_stated=stated,
        crs=raw.crs,
        warnings=(
            *warnings,
            *raw.warnings,
            *said,
            *_ignored(name, wanted),
            *unit_warnings,
            *seen.warnings,
        ),
        projected=raw.projected,
        viewpoint_m=None if raw.viewpoint is None else _triple(np.array(raw.viewpoint) * factors),
        raster=raw.raster,
        quantum_m=_triple(seen.quantum * factors),
        format=name,
        whole=raw.whole and replace(raw.whole, metres=_triple(factors)),
    )


def _judged(raw: RawCloud, unit: str, wanted: Wanted, *, stated: bool) -> Judged:
    """Check a file's numbers for steps and unit; in a few lines of points, steps mean nothing."""
    if wanted.stretches is not None:
        heights = steps(raw.xyz, unit)[0] * (0.0, 0.0, 1.0)
        return Judged(raw.xyz, heights, () if stated else doubts_of(raw.xyz))
    if raw.whole is None or raw.whole.points == len(raw.xyz):
        return judged(raw.xyz, unit, stated=stated)
    return Judged(raw.xyz, np.zeros(3), () if stated else doubts_of(raw.xyz))


def _raw(file: Path | str, wanted: Wanted) -> tuple[str, RawCloud, tuple[str, ...]]:
    """Return a file's format, its content, and a warning if its name says another format."""
    if isinstance(file, str):
        return "LAS/LAZ", read_url(file, wanted), ()
    if wanted.some and begins_as_las(file):
        return "LAS/LAZ", sample_las(file, wanted), ()
    name, data = unpacked(file, bytes_of(file))
    found, warnings = detect(name, data)
    return found.name, found.read(data, wanted), warnings


def _triple(numbers: FloatArray) -> tuple[float, float, float]:
    x, y, z = numbers.tolist()
    return x, y, z


def _ignored(format_name: str, wanted: Wanted) -> tuple[str, ...]:
    """Return a warning if classes or returns are asked for and the format has none."""
    if format_name == "LAS/LAZ" or (wanted.classes is None and wanted.returns == "all"):
        return ()
    return (f"{format_name} has no classes and returns: all points were taken",)


def _units(raw: RawCloud, asked: str) -> tuple[str, str, tuple[str, ...]]:
    """Return the unit of the file's x and y, that of its z, and warnings."""
    if asked != "auto":
        differs = raw.unit not in (None, asked)
        warning = f"the file states the unit {raw.unit}, but was read in {asked} as asked"
        return asked, asked, (warning,) if differs else ()
    unit = raw.unit or "m"
    vertical = raw.vertical_unit or unit
    if unit in (DEGREES, STRETCHED):
        raise DivespotError(
            f"its coordinates are {unit}: a projection to metres is needed, or the unit"
        )
    if raw.unit is None and raw.vertical_unit not in (None, "m"):
        raise DivespotError(
            f"its z is in {vertical}, the unit of x and y is not stated: one unit is needed"
        )
    for stated in (unit, vertical):
        if stated not in UNITS:
            raise DivespotError(f"its unit is {stated!r}: one of {accepted_units()} is needed")
    warning = f"x and y are in {unit}, z in {vertical}"
    return unit, vertical, (warning,) if vertical != unit else ()


def _scaled(xyz: FloatArray, factors: FloatArray) -> FloatArray:
    if (factors == 1.0).all():
        return xyz
    # Corrupt values near the largest float may overflow to inf, which is dropped and counted later.
    with np.errstate(over="ignore", invalid="ignore"):
        scaled: FloatArray = xyz * factors
    return scaled
