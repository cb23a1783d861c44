"""The paper's method, a stage a line: a scan in, piles out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from divespot import stages
from divespot.progress import Progress
from divespot.report import Report, Total
from divespot.settings import Settings

if TYPE_CHECKING:
    import os
    from collections.abc import Callable

    from numpy.typing import ArrayLike


def measure(
    source: str | os.PathLike[str] | ArrayLike,
    settings: Settings | None = None,
    *,
    on_stage: Callable[[str], None] | None = None,
    **changes: Any,  # noqa: ANN401 - as many types as settings
) -> Report:
    """Measure every pile in a scan.

    Parameters
    ----------
    source
        The path of a scan (PLY, PCD, LAS, LAZ, XYZ, CSV, TXT, NPY, NPZ), or points of shape
        ``(n, 3)`` in metres. Points that are not finite or all zero are dropped and counted.
    settings
        What to do; by default `Settings()`, where every length follows from the scan.
    on_stage
        Called with the name of each stage as it begins.
    **changes
        Single settings by name, instead of `settings`.

    Returns
    -------
    report
        The piles, largest first, with volumes and uncertainties. The same points give the same
        report, bit for bit and times aside, in any order and at any number of threads.

    Raises
    ------
    DivespotError
        The scan cannot be read, too few points are left, no plane goes through them, or a
        setting is unknown or out of range.

    """
    s = settings if settings is not None else Settings()
    s = stages.changed(s, changes)
    run = Progress(on_stage)
    cloud = run("read", stages.read, source, s)
    points = run("crop", stages.crop, cloud, s)
    survey, s = run("survey", stages.survey, points, s)
    points = run("radius filter", stages.radius_filter, points, s)
    points = run("scene cluster", stages.scene_cluster, points, s, run.warn)
    points = run("voxels", stages.voxels, points, s)
    pose = run("pose", stages.find_pose, points, survey, s)
    grid = run("height map", stages.level_map, points, pose, s)
    ground, s = run("ground", stages.find_ground, grid, s)
    labels = run("fine filter", stages.find_objects, grid, ground, s, run.warn)
    objects = run("volume", stages.measure_objects, grid, labels, ground, s)
    piles, others = stages.sorted_out(objects, cloud, pose, s)
    return Report(
        source=cloud.source,
        piles=piles,
        other_objects=others,
        total=Total.of(piles),
        ground=stages.ground_in_scan(pose, ground, points, cloud, s),
        settings=s,
        timings_s=run.timings_s,
        warnings=(*cloud.warnings, *run.warnings, *stages.doubts(piles, others, pose, points)),
        level=stages.level(grid, objects, ground),
    )
