"""What a cloud says of itself; all default lengths follow from it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot._arguments import as_floats, seed_number, thread_number
from divespot.kernels import voxel_downsample
from divespot.plane import fit_plane
from divespot.settings import SIGMAS, ground_lengths

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from divespot.intake import Cloud
    from divespot.settings import Settings

#: Thresholds that are tried, each half of the one before.
HALVINGS = 8

#: The ground holds at least this share of the points, and that part of normal values lies within
#: so many standard deviations.
FLAT_SHARE = 0.3
FLAT_QUANTILE = 0.385

#: A quarter of the surface at least is sparser than the typical point by this factor, or the
#: density is even: distances to a fourth neighbour at random scatter by a third.
UNEVEN = 2.5

#: Such a scan is thinned to voxels of so many of the spacings where points are few.
THINNED = 1.0

#: A cloud without noise, too, has a threshold: this share of the one by its spacing.
SMALLEST = 1e-3


@dataclass(frozen=True, eq=False)
class Survey:
    """Point spacing, roughness and surface normals of a cloud.

    Attributes
    ----------
    spacing_m
        Typical distance between neighbouring points: the step of a square grid, about
        1.1 / sqrt(points per square metre) on a random surface, twice the step of a line.
    regular
        Whether that is the step of a regular raster: the same nearly everywhere.
    roughness_m
        Typical distance of a point from the plane through its sixteen nearest neighbours.
    at_m
        Shape ``(k, 3)``: some of the points, at most 2,000.
    normals
        Shape ``(k, 3)``: unit normals of the surface there; their signs mean nothing.
    sparse_m
        The same as `spacing_m` where points are few: three quarters of the surface are as dense
        at least.

    """

    spacing_m: float
    regular: bool
    roughness_m: float
    at_m: NDArray[np.float64]
    normals: NDArray[np.float64]
    sparse_m: float


def survey(points: ArrayLike, *, seed: int = 0, threads: int = 0) -> Survey:
    """Survey the neighbourhoods of about 2,000 of the points.

    Parameters
    ----------
    points
        Shape ``(n, 3)``, in metres. Duplicates count as one position.
    seed
        Decides which points are looked at; their order does not.
    threads
        0 takes every core that the process may use.

    Raises
    ------
    DivespotError
        `points` have the wrong shape or type, or fewer than five distinct positions.

    """
    return Survey(
        *_native.survey(as_floats("points", points), seed_number(seed), thread_number(threads))
    )


def take_survey(
    points: NDArray[np.float64], steps_m: tuple[float, float, float], settings: Settings
) -> tuple[Survey, Settings]:
    """Survey a cloud, and return the lengths that follow with it.

    Points whose x or y are rounded to `steps_m` are no denser than these steps.
    """
    found = survey(points, seed=settings.seed, threads=settings.threads)
    apart_m = max(*steps_m[:2], found.spacing_m)
    found = replace(found, spacing_m=apart_m, sparse_m=max(apart_m, found.sparse_m))
    return found, settings.resolved(found, len(points))


def even_out(
    cloud: Cloud, found: Survey, resolved: Settings, asked: Settings
) -> tuple[NDArray[np.float64], Survey, Settings]:
    """Thin a scan whose density is uneven, as far as it is denser than most of its surface.

    Near a tripod a scanner leaves hundreds of times more points than on the top of a pile; cells
    that suit the former would be empty on the latter. Lengths follow from what is left.
    """
    if found.sparse_m <= UNEVEN * found.spacing_m:
        return cloud.points, found, resolved
    even = voxel_downsample(cloud.points, THINNED * found.sparse_m, threads=asked.threads)
    return even, *take_survey(even, cloud.quantum_m, asked)


def flatness(found: Survey, settings: Settings) -> float:
    """Return the standard deviation of the flattest part of a cloud about its plane, in metres.

    Where points are as far apart as piles are high, neighbours do not tell how thick the ground
    is, and a threshold by their spacing takes the piles for a part of it. Of the planes within
    ever smaller thresholds the one is taken to which the nearest share of the surveyed points
    lies nearest (least quantile of squares).
    """
    widest_m = ground_lengths(found)["plane_threshold_m"]
    least = widest_m * FLAT_QUANTILE / SIGMAS
    for halvings in range(HALVINGS):
        threshold_m = widest_m / 2.0**halvings
        plane = fit_plane(found.at_m, threshold_m, seed=settings.seed, threads=settings.threads)
        off = np.abs(found.at_m @ np.array(plane.normal) - plane.offset_m)
        least = min(least, float(np.quantile(off, FLAT_SHARE)))
    return max(least / FLAT_QUANTILE, SMALLEST * widest_m)


def point_spacing(points: ArrayLike, *, seed: int = 0) -> float:
    """Return the typical distance between neighbouring points, in metres (see `Survey`)."""
    return survey(points, seed=seed).spacing_m
