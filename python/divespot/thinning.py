"""The survey of a scan, and thinning of scans of uneven density."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from divespot import _native
from divespot.kernels import voxel_downsample
from divespot.lengths import by_survey
from divespot.spacing import Survey

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.intake import Cloud
    from divespot.settings import Settings

#: Density is uneven if a quarter of the surface or more is sparser than the typical spacing by this
#: factor. For random points, distances to the fourth neighbour vary by a third.
UNEVEN = 2.5

#: Edge of the voxels to which such a scan is thinned, in spacings of its sparse part.
THINNED = 1.0


def take_survey(
    points: NDArray[np.float64], steps_m: tuple[float, float, float], settings: Settings
) -> tuple[Survey, Settings]:
    """Survey a cloud, and return the result with the lengths derived from it.

    The spacing is at least the step to which x or y are rounded.
    """
    found = Survey(*_native.survey(points, settings.seed, settings.threads, own=True))
    apart_m = max(*steps_m[:2], found.spacing_m)
    found = replace(found, spacing_m=apart_m, sparse_m=max(apart_m, found.sparse_m))
    return found, by_survey(settings, found)


def even_out(
    cloud: Cloud, found: Survey, resolved: Settings, asked: Settings
) -> tuple[NDArray[np.float64], Survey, Settings]:
    """Thin a scan of uneven density where it is denser than most of its surface.

    Near a tripod, a scan has hundreds of times more points than on the top of a pile; cells that
    suit the former would be empty on the latter. Lengths are derived from the thinned scan.
    """
    if found.sparse_m <= UNEVEN * found.spacing_m:
        return cloud.points, found, resolved
    even = voxel_downsample(cloud.points, THINNED * found.sparse_m, threads=asked.threads)
    return even, *take_survey(even, cloud.quantum_m, asked)
