"""Comparing two surveys of a site."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from divespot._arguments import require_kind, switch
from divespot.errors import DivespotError, NoFloorError
from divespot.intake import load
from divespot.io import UNITS
from divespot.pipeline import measure_cloud
from divespot.progress import Progress
from divespot.results.alignment import align
from divespot.results.changes import comparison_of
from divespot.results.comparison import Fit
from divespot.results.crs_name import crs_name
from divespot.results.pile_matching import both_labels, labels, slopes_between
from divespot.results.sideways import sideways, unchanged
from divespot.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeAlias

    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from divespot._typed import Changes
    from divespot.doors import Comparison, Report
    from divespot.intake import Cloud, Scannable, Source
    from divespot.results.alignment import Alignment
    from divespot.results.sideways import Sideways

    Heights: TypeAlias = NDArray[np.float64]

#: An earlier scan is raised if the plane is off by more than this many standard uncertainties.
SURE = 2.0


def compare(
    before: Scannable,
    after: Scannable,
    settings: Settings | None = None,
    *,
    do_align: bool = True,
    on_stage: Callable[[str], None] | None = None,
    **changes: Unpack[Changes],
) -> Comparison:
    """Measure what was gained and lost between two scans of a site.

    Both must be in one frame. The earlier scan is raised, and tilted if a plane fits, so that the
    ground of both agrees where neither survey shows a pile (see `divespot.results.alignment`), and
    shifted in x and y so that piles of unchanged volume coincide; if there are none, x and y are
    taken as they are. The uncertainty of this alignment is part of every u95, and so is the
    difference over unchanged ground (`divespot.judgement`), which also gives the detection limit.

    Parameters
    ----------
    before, after
        Paths of scans, or points, as `divespot.measure` takes them.
    settings, **changes
        As `divespot.measure` takes them; `base` is the base surface of the piles in each survey.
    do_align
        Raise and shift the earlier scan; if False, it is used as it is.
    on_stage
        Called with the name of each stage as it begins.

    Raises
    ------
    DivespotError
        A scan cannot be measured, or the two are in different coordinate systems.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import divespot
    >>> from divespot import simulate
    >>> monday = simulate.scene_named("three-piles")
    >>> tuesday = replace(monday, piles=monday.piles[1:])  # the first of them, 0.035 m3, is gone
    >>> scans = (simulate.scan(day, density=0.03).points for day in (monday, tuesday))
    >>> found = divespot.compare(*scans)
    >>> [match.state for match in found.piles]
    ['in both', 'in both', 'gone']
    >>> f"{found.net.volume_m3:.3f} m3"
    '-0.035 m3'

    """
    from tempfile import TemporaryDirectory  # noqa: PLC0415 - slow to import

    if settings is not None:
        require_kind("settings", settings, Settings)
    is_wanted = switch("do_align", do_align)
    s = (settings or Settings()).changed(**changes)
    runs = [Progress(_named(on_stage, name)) for name in ("before", "after")]
    clouds = runs[0]("read", load, before, s), runs[1]("read", load, after, s)
    _refuse_other_system(clouds[0].source, clouds[1].source)
    first, second = (_alone(cloud, s, run) for cloud, run in zip(clouds, runs, strict=True))
    points = _in_scan(clouds[0], clouds[1].source)
    with TemporaryDirectory(prefix="divespot-") as folder:
        path = Path(folder) / "before.npy"

        def held_against(earlier: Heights) -> Report:
            np.save(path, earlier)
            run = Progress(_named(on_stage, "change"))
            found = measure_cloud(clouds[1].altered(), s.changed(base=f"surface={path}"), run)
            # The file is gone soon.
            return dataclasses.replace(found, settings=found.settings.changed(base=s.base))

        difference = held_against(points)
        at = difference.level.height_map.centers_m()
        found = align(_stable(first, second, difference), *at)
        beside = _sideways(first, second, difference, found)
        aligned = is_wanted and _is_off(found, beside)
        if aligned:
            points = _moved(points, found, beside, difference)
            difference = held_against(points)
    return comparison_of(
        (first, second),
        (clouds[0].source, clouds[1].source),
        difference,
        Fit(found, beside, difference.level.spread, aligned=aligned),
    )


def _in_scan(cloud: Cloud, source: Source) -> Heights:
    """Return a cloud's points in the frame and the unit of the scans."""
    metres = cloud.points * (cloud.scale, cloud.scale, 1.0) + cloud.origin_m
    return np.asarray(metres / UNITS[source.unit])


def _alone(cloud: Cloud, settings: Settings, run: Progress) -> Report | None:
    """Return the report of one scan; None if it shows no ground for piles."""
    try:
        return measure_cloud(cloud.altered(), settings, run)
    except NoFloorError:
        return None


def _named(on_stage: Callable[[str], None] | None, what: str) -> Callable[[str], None] | None:
    return None if on_stage is None else lambda stage: on_stage(f"{what}: {stage}")


def _refuse_other_system(before: Source, after: Source) -> None:
    one, other = crs_name(before.crs), crs_name(after.crs)
    if one and other and one != other:
        raise DivespotError(
            f"BEFORE is in {one}, AFTER in {other}: one coordinate system is needed"
        )


def _stable(before: Report | None, after: Report | None, difference: Report) -> Heights:
    """Return the height differences of cells that are ground in both surveys, NaN elsewhere.

    If ground is missing in either survey, all are NaN.
    """
    level = difference.level
    off: Heights = level.height_map.heights_m - level.base_m
    for report in (before, after):
        if report is None:
            return np.full_like(off, math.nan)
        standing = (*report.piles, *report.other_objects)
        off[labels(standing, level.frame, level) > 0] = math.nan
    return off


def _sideways(
    before: Report | None, after: Report | None, difference: Report, found: Alignment
) -> Sideways | None:
    """Return the offset of the scans in x and y; None if there is no unchanged pile."""
    if before is None or after is None or not found.blocks:
        return None
    level = difference.level
    stood = unchanged((before, after), both_labels(before.piles, after.piles, level))
    off = level.height_map.heights_m - level.base_m - found.raise_m(*level.height_map.centers_m())
    return sideways(off, slopes_between(level), stood)


def _is_off(found: Alignment, beside: Sideways | None) -> bool:
    """Return whether the plane or the shift differs from zero by more than its uncertainty."""
    values = np.array([found.offset_m, *found.tilt])
    u = np.sqrt(np.diag(found.covariance))
    if beside is not None:
        values = np.append(values, beside.shift_m)
        u = np.append(u, np.sqrt(np.diag(beside.covariance)))
    return bool(found.blocks and (np.abs(values) > SURE * u).any())


def _moved(
    points: Heights, found: Alignment, beside: Sideways | None, difference: Report
) -> Heights:
    """Return the earlier scan's points, raised by the plane along up, and shifted back in plan."""
    frame = difference.level.frame
    level = frame.to_level(points)
    level[:, 2] += found.raise_m(level[:, 0], level[:, 1])
    if beside is not None:
        level[:, :2] -= beside.shift_m
    return frame.to_scan(level)
