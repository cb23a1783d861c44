"""Outliers in clouds of few points, where each would be a corner of the triangulated surface."""

from __future__ import annotations

from typing import TYPE_CHECKING

from divespot import _native
from divespot.lengths import by_flatness, flatness
from divespot.pose import find_pose
from divespot.selection import rows_of
from divespot.spacing import survey

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.intake import Cloud
    from divespot.settings import Settings
    from divespot.spacing import Survey


def drop_surface_outliers(
    points: NDArray[np.float64], found: Survey, cloud: Cloud, settings: Settings
) -> tuple[NDArray[np.float64], Survey, Settings]:
    """Drop points off the surface if points are few, and survey the rest.

    A mean over a cell hardly changes with an outlier; a triangle between few points does. After
    voxel downsampling, half of the points may be outliers: each of them remains, while hundreds of
    points of the surface became one. The ground is first found roughly among all points, then its
    thickness among the remaining ones.
    """
    if settings.stages.surface == "cells":
        return points, found, settings
    rough = by_flatness(settings, flatness(found, settings))
    pose = find_pose(points, found, cloud, rough)
    level = pose.level(points, settings.threads)
    kept = rows_of(points, _native.surface_mask(level, settings.threads))
    again = survey(kept, seed=settings.seed, threads=settings.threads)
    return kept, again, by_flatness(settings, flatness(again, settings))
