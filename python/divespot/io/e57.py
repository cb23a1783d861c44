"""E57 (ASTM E2807), through the Rust crate of that name: one or more scans, each with its pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.errors import DivespotError, damaged
from divespot.io.crs import Crs, crs_from_wkt
from divespot.io.scan import FloatArray, RawCloud, stack
from divespot.io.setups import Setup, merged
from divespot.io.units import DEGREES, STRETCHED

if TYPE_CHECKING:
    from collections.abc import Sequence

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ", "cartesianInvalidState")
_SPHERICAL = (
    *("sphericalRange", "sphericalAzimuth", "sphericalElevation"),
    "sphericalInvalidState",
)


def read_e57(data: bytes) -> RawCloud:
    """Read x, y, z of all scans of an E57 file, in its common frame; invalid points are NaN."""
    try:
        system, scans = _native.read_e57(data)
    except DivespotError as err:
        raise damaged(f"not a readable E57 file ({err})") from None
    setups = [_setup(*scan) for scan in scans if len(scan[1])]
    xyz, place = merged(setups)
    crs = crs_from_wkt(system) if system and system.strip() else Crs()
    # By the standard, lengths are metres; systems in degrees or with a stretched map are refused.
    unit = crs.unit if crs.unit in (DEGREES, STRETCHED) else "m"
    return RawCloud(xyz, unit, crs=crs.text, projected=crs.projected, viewpoint=place)


def _setup(names: Sequence[str], values: FloatArray, pose: tuple[float, ...] | None) -> Setup:
    columns = dict(zip(names, values.T, strict=True))
    w, x, y, z, *place = pose or (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return Setup(_points(columns), _turn(np.array([w, x, y, z])), np.array(place))


def _points(columns: dict[str, FloatArray]) -> FloatArray:
    """Return x, y, z from the valid coordinates, Cartesian ones if present."""
    known = [kind for kind in (_CARTESIAN, _SPHERICAL) if all(name in columns for name in kind[:3])]
    if not known:
        raise DivespotError(
            "a scan in it has neither Cartesian nor spherical coordinates: either is needed"
        )
    xyz = np.full((len(next(iter(columns.values()))), 3), np.nan)
    for kind in reversed(known):
        found = stack([columns[name] for name in kind[:3]])
        found = found if kind is _CARTESIAN else _cartesian(found)
        # 1: only the direction is valid, 2: nothing is.
        valid = columns.get(kind[3], np.zeros(len(xyz))) == 0.0
        xyz[valid] = found[valid]
    return xyz


def _cartesian(spherical: FloatArray) -> FloatArray:
    """Return x, y, z of range, azimuth from x to y, and elevation from the x-y plane."""
    distance, azimuth, elevation = spherical.T
    with np.errstate(invalid="ignore", over="ignore"):
        level = distance * np.cos(elevation)
        return stack(
            [level * np.cos(azimuth), level * np.sin(azimuth), distance * np.sin(elevation)]
        )


def _turn(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrix of a quaternion w, x, y, z of any length but zero."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        w, x, y, z = quaternion / np.linalg.norm(quaternion)
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
