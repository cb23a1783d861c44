"""From a scan as it was read to the points that are measured (paper, Pre-process)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot.filters import radius_filter, scene_cluster, voxels
from divespot.surface_outliers import drop_surface_outliers
from divespot.thinning import even_out, take_survey

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.intake import Cloud
    from divespot.progress import Progress
    from divespot.settings import Settings
    from divespot.spacing import Survey


def cleaned(
    cloud: Cloud, s: Settings, run: Progress
) -> tuple[NDArray[np.float64], Survey, Settings]:
    """Return the points that count, which takes those of the cloud, and the lengths that follow."""
    scan, resolved = run("survey", take_survey, cloud.points, cloud.quantum_m, s)
    points, scan, s = run("thinning", even_out, cloud, scan, resolved, s)
    cloud = cloud.without_points()
    points = run("radius filter", radius_filter, points, scan, s)
    points = run("scene cluster", scene_cluster, points, s, run.warn)
    points = run("voxels", voxels, points, s)
    return run("surface outliers", drop_surface_outliers, points, scan, cloud, s)
