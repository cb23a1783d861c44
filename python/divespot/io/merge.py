"""Several files as one survey: tiles of a flight, set-ups of a scanner."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from divespot.errors import DivespotError
from divespot.io.systems import is_same_system

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.io.scan import Scan

Path = str | os.PathLike[str]


def are_paths(source: Any) -> TypeGuard[Sequence[Path]]:  # noqa: ANN401 - what a user gives
    """Return whether the argument is a list of one or more paths."""
    is_listed = isinstance(source, list | tuple) and len(source) > 0
    return is_listed and all(isinstance(path, str | os.PathLike) for path in source)


def paths_of(source: Any) -> list[str]:  # noqa: ANN401 - as above
    """Return the paths of a survey of one or more files."""
    return [os.fsdecode(path) for path in (source if are_paths(source) else [source])]


def merged(scans: Sequence[Scan]) -> Scan:
    """Return all points of several scans in one frame and unit.

    Raises
    ------
    DivespotError
        Two scans state different units or reference systems.

    """
    first = scans[0]
    if len(scans) == 1:
        return first
    for scan in scans[1:]:
        _require_same(first, scan)
    most = max(scans, key=lambda scan: len(scan.points))
    steps = np.max([scan.quantum_m for scan in scans], axis=0).tolist()
    return replace(
        first,
        points=np.concatenate([scan.points for scan in scans]),
        files=tuple(str(scan.path) for scan in scans),
        warnings=(*_told(scans), *_without_system(scans)),
        crs=next((scan.crs for scan in scans if scan.crs), None),
        projected=any(scan.projected for scan in scans),
        viewpoint_m=most.viewpoint_m,
        raster=None,
        quantum_m=(steps[0], steps[1], steps[2]),
    )


def _require_same(first: Scan, other: Scan) -> None:
    names = f"{first.path} and {other.path}"
    if (first.unit, first.unit_stated) != (other.unit, other.unit_stated):
        units = " and in ".join(
            scan.unit if scan.unit_stated else "a unit that is not stated"
            for scan in (first, other)
        )
        raise DivespotError(
            f"{names} are in {units}: one unit is needed for one survey (--unit, or files of one)"
        )
    if first.crs and other.crs and not is_same_system(first.crs, other.crs):
        systems = " and in ".join(_short(scan.crs) for scan in (first, other))
        raise DivespotError(
            f"{names} are in {systems}: one reference system is needed for one survey"
        )


def _short(crs: str | None) -> str:
    """Return the name of a reference system."""
    text = " ".join((crs or "").split())
    return text.split('"')[1][:60] if text.count('"') > 1 else text[:60]


def _told(scans: Sequence[Scan]) -> tuple[str, ...]:
    """Return each warning once, with the files that it is about unless it is about all."""
    files: dict[str, list[str]] = {}
    for scan in scans:
        for warning in scan.warnings:
            files.setdefault(warning, []).append(str(scan.path))
    return tuple(
        text if len(names) == len(scans) else f"{named(names)}: {text}"
        for text, names in files.items()
    )


def _without_system(scans: Sequence[Scan]) -> tuple[str, ...]:
    without = [str(scan.path) for scan in scans if not scan.crs]
    if not without or len(without) == len(scans):
        return ()
    return (f"{named(without)} states no reference system: that of the others was taken",)


def named(names: Sequence[str]) -> str:
    """Return the first of some names, and the number of others."""
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
