"""The method, one stage per line: a scan in, piles out."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from divespot.bases import find_bases, unknown, whole_base
from divespot.cleaning import cleaned
from divespot.describe import describe, doubts, ground_in_scan, reported
from divespot.differences import is_held_against, measure_differences, unsure
from divespot.doors import Report
from divespot.earlier import common_pose, map_earlier, read_earlier
from divespot.frame import Frame
from divespot.gaps import close_gaps
from divespot.ground_level import find_ground
from divespot.intake import crop, load
from divespot.level import Level
from divespot.objects import measure_regions
from divespot.outline_file import find_regions
from divespot.progress import Progress
from divespot.repeated import measure_again
from divespot.report import Total
from divespot.rounding import Rounding
from divespot.settings import as_settings
from divespot.standing import measure_standing
from divespot.surface import find_surface, map_heights
from divespot.tiled import Overview, blocks_of, for_overview, measure_windows

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from typing_extensions import Unpack

    from divespot._typed import Changes
    from divespot.intake import Cloud, Scannable
    from divespot.settings import Settings


def measure(
    source: Scannable,
    settings: Settings | Mapping[str, Any] | None = None,
    *,
    on_stage: Callable[[str], None] | None = None,
    **changes: Unpack[Changes],
) -> Report:
    """Measure every pile in a scan.

    Parameters
    ----------
    source
        The path of a scan (PLY, PCD, LAS, LAZ, E57, PTX, XYZ, CSV, TXT, NPY, NPZ); a list of
        paths that are one survey; points of shape ``(n, 3)``, or ``(h, w, 3)`` for the pixels of a
        frame, in metres; an Open3D point cloud; or a `Scan`, as `divespot.frames.fuse` returns.
        Points that are not finite or all zero are dropped and counted.
    settings
        `Settings`, or a dict of some of them, such as those of a report; by default
        `Settings()`, where every length is derived from the scan.
    on_stage
        Called with the name of each stage as it begins.
    **changes
        Single settings by name, which override those in `settings`. `Settings` has the list.

    Returns
    -------
    report
        The piles, largest first, with volumes and uncertainties. The same points give the same
        report, bit for bit except for times, in any order and at any number of threads.

    Raises
    ------
    DivespotError
        The scan cannot be read, too few points are left, no plane goes through them, or a
        setting is unknown or out of range.

    Examples
    --------
    >>> import divespot
    >>> from divespot import simulate
    >>> scan = simulate.scan("shape-05", density=0.03)  # 0.028 m3 under a depth camera
    >>> report = divespot.measure(scan.points)
    >>> [f"{pile.volume_m3:.3f} m3" for pile in report.piles]
    ['0.028 m3']
    >>> divespot.measure(scan.points, material="corn", up="z").total.mass_kg > 15
    True
    >>> divespot.measure(scan.points, radus_m=0.1)
    Traceback (most recent call last):
    divespot.errors.DivespotError: unknown setting 'radus_m': one of unit, crs, ... is needed

    """
    s = as_settings(settings, **changes)
    run = Progress(on_stage)
    if s.repeat:
        return measure_again(measure_cloud, run("read", load, source, s), s, run)
    return measure_cloud(run("read", load, source, s), s, run)  # nothing else may hold the points


def measure_cloud(cloud: Cloud, s: Settings, run: Progress) -> Report:
    """Measure every pile in a scan that was read, and whose points are used up."""
    blocks = blocks_of(cloud, s)
    asked, s = s, for_overview(s) if blocks else s
    cloud = run("crop", crop, cloud, s)
    points, scan, s = cleaned(cloud, s, run)
    cloud = cloud.without_points()
    before = run("earlier scan", read_earlier, cloud, s)
    pose = run("pose", common_pose, points, scan, before, cloud, s)
    points = run("rotation", pose.laid_level, points, s.threads)
    points, gaps = run("gaps", close_gaps, points, s)
    surface, count = run("surface", find_surface, points, scan, s), len(points)
    del points  # the surface has them, until they are handed over
    grid = run("height map", map_heights, surface, s)
    ground, s = run("ground", find_ground, grid, scan, s)
    frame = Frame(pose, cloud.origin_m, cloud.source.unit, cloud.scale)
    closed = replace(frame, gaps=gaps)
    earlier = run("earlier surface", map_earlier, before, pose, surface, grid, s)
    bases = run("base", find_bases, grid, ground, frame, earlier, s)
    is_held = not s.is_outlined and is_held_against(grid, ground, s)
    places_m = gaps.opened(surface.points) if blocks else None
    if s.is_outlined:
        regions = run("outline", find_regions, s, frame, cloud.source.crs, run.warn)
        measured = run("volume", measure_regions, surface, grid, regions, bases, s)
    elif is_held:
        measured = run("volume", measure_differences, surface, grid, earlier, bases, s)
    else:
        measured = measure_standing(surface, grid, bases, s, run)
    base_m = whole_base(grid, bases, measured.base_m, s)
    found = describe(measured, closed, Rounding.of(cloud, pose, scan), s, cloud.registration)
    if blocks and places_m is not None and not is_held:
        whole = Overview(cloud, blocks, places_m, frame, bases, measured.regions, asked, s)
        found, s = run("windows", measure_windows, whole, found, run)
    piles, others, drawn = reported(found)
    return Report(
        source=cloud.source,
        piles=piles,
        other_objects=others,
        total=Total.of(piles, s),
        ground=ground_in_scan(pose, ground, cloud, count),
        settings=s,
        timings_s=run.timings_s,
        warnings=run.told(
            *cloud.warnings,
            *run.warnings,
            *pose.warnings,
            *unknown(base_m, measured.base_m),
            *unsure(measured, earlier),
            *doubts(piles, others, pose, count, s),
        ),
        scene=Level(grid, base_m, ground.height_m, drawn, frame, gaps, measured.spread),
    )
