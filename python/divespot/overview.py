"""A scan before it is measured: size, spacing, unit, reference system, classes, up, ground."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.directions import parse_up
from divespot.errors import DivespotError
from divespot.intake import cloud_of
from divespot.io import UNITS, sample
from divespot.lengths import by_flatness, by_survey, flatness
from divespot.pose import find_pose
from divespot.report import finite
from divespot.settings import Settings
from divespot.thinning import take_survey

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping

    from divespot.directions import Position
    from divespot.intake import Cloud
    from divespot.io import Scan
    from divespot.spacing import Survey
    from divespot.up import UpFrom

SCHEMA = "divespot.info/1"

#: Typical distance between random points at a density of one per square metre; on a raster it is 1.
RANDOM_M = 1.1


@dataclass(frozen=True)
class Level:
    """The ground's plane, and the evidence for which side of it is up.

    As in `divespot.report.Ground`: the normal points up; `share` is the part of the points on it.
    """

    normal: Position
    up_from: UpFrom
    tilt_deg: float
    share: float


@dataclass(frozen=True)
class Info:
    """The result of `divespot.info`.

    Attributes
    ----------
    points
        Number of all points, of which `looked_at` were read. The counts of points that are not
        finite or all zero, spacing, density, classes and ground are for the points that were read.
    low, high
        Corners of the box around all points, in the scan's frame and unit.
    spacing_m
        Typical distance between neighbours, from which the points per square metre follow.
    classes
        For a LAS file: how many points of each class were read.
    scale_factor
        As in `divespot.Source`.
    sensor_m
        Position of the sensor, if known.
    ground
        None if no ground is found; `warnings` then give the reason.

    """

    path: str
    format: str
    size_bytes: int
    points: int
    looked_at: int
    dropped_nonfinite: int
    dropped_zero: int
    low: Position
    high: Position
    spacing_m: float
    density_per_m2: float
    unit: str
    unit_stated: bool
    crs: str | None
    scale_factor: float | None
    projected: bool
    classes: Mapping[int, int]
    sensor_m: Position | None
    ground: Level | None
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the fields as JSON values."""
        plain: dict[str, Any] = finite(dataclasses.asdict(self))
        return {"schema": SCHEMA, **plain}


def info(path: str | os.PathLike[str], *, unit: str = "auto", up: str = "auto") -> Info:
    """Describe a scan, in about a second whatever its size.

    A LAS or LAZ file of more than a million points is sampled in stretches spread over the file;
    other files are read in full.

    Parameters
    ----------
    path
    unit, up
        As in `divespot.Settings`.

    Raises
    ------
    DivespotError
        The scan cannot be read, or too few points are left.

    Examples
    --------
    >>> import divespot
    >>> from divespot import io, simulate
    >>> io.write("scan.ply", simulate.scan("shape-05", density=0.03).points)
    >>> found = divespot.info("scan.ply")
    >>> found.unit, found.points > 1000
    ('m', True)

    """
    settings = Settings(unit=unit, up=up)
    parse_up(settings.up)
    scan = sample(path, unit=unit)
    cloud = cloud_of(scan, settings)
    survey, _ = take_survey(cloud.points, cloud.quantum_m, settings)
    ground, doubts = _level(cloud, survey, settings)
    low, high = _bounds(scan, cloud)
    typical = 1.0 if survey.regular else RANDOM_M
    source = cloud.source
    return Info(
        path=str(scan.path),
        format=str(scan.format),
        size_bytes=Path(str(scan.path)).stat().st_size,
        points=scan.whole.points if scan.whole else len(scan.points),
        looked_at=len(scan.points),
        dropped_nonfinite=source.dropped_nonfinite,
        dropped_zero=source.dropped_zero,
        low=low,
        high=high,
        spacing_m=survey.spacing_m,
        density_per_m2=(typical / survey.spacing_m) ** 2,
        unit=source.unit,
        unit_stated=scan.unit_stated,
        crs=scan.crs,
        scale_factor=source.scale_factor,
        projected=scan.projected,
        classes=dict(sorted(scan.whole.classes.items())) if scan.whole else {},
        sensor_m=cloud.sensor_m,
        ground=ground,
        warnings=(*cloud.warnings, *doubts),
    )


def _level(
    cloud: Cloud, survey: Survey, settings: Settings
) -> tuple[Level | None, tuple[str, ...]]:
    """Return the ground's plane, or the reason why none was found."""
    try:
        resolved = by_survey(settings, survey)
        flat = by_flatness(resolved, flatness(survey, resolved))
        pose = find_pose(cloud.points, survey, cloud, flat)
    except DivespotError as error:
        return None, (str(error),)
    share = pose.plane.inliers / len(cloud.points)
    return Level(pose.plane.normal, pose.up_from, pose.tilt_deg, share), pose.warnings


def _bounds(scan: Scan, cloud: Cloud) -> tuple[Position, Position]:
    """Return the corners of the box around all points, in the scan's unit."""
    if scan.whole:
        ends = np.array([scan.whole.low, scan.whole.high])
    else:
        near = np.array([cloud.points.min(axis=0), cloud.points.max(axis=0)])
        ends = (near * (cloud.scale, cloud.scale, 1.0) + cloud.origin_m) / UNITS[scan.unit]
    (x, y, z), (x1, y1, z1) = ends.tolist()
    return (x, y, z), (x1, y1, z1)
