"""From a levelled cloud to the objects on its ground (paper, Algorithm 3 to Voxel Meshing)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot import _native
from divespot.clusters import find_clusters
from divespot.detection import NO_SPREAD, Spread
from divespot.errors import DivespotError
from divespot.kernels import radius_outlier_mask
from divespot.outline_file import name_of
from divespot.settings import given

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from divespot.bases import Bases
    from divespot.grid import HeightMap
    from divespot.ground_level import GroundLevel
    from divespot.outline_file import Region
    from divespot.settings import Settings
    from divespot.stages import Stages
    from divespot.surface import HandedOver, Surface

    Found: TypeAlias = tuple[NDArray[np.int32], NDArray[np.bool_], HandedOver]
    Measuring: TypeAlias = tuple[
        int,
        float,
        float,
        tuple[float, float, float],
        tuple[int, int],
        Sequence[_native.RawBase | None],
        int,
    ]

#: Fewest points of an object: a summit and its eight neighbours. Fewer define no shape.
FEWEST_POINTS = 9

#: A warning is given if more than this share of the cells above the ground is in no object.
LOOSE_SHARE = 0.25


def find_objects(
    grid: HeightMap, ground: GroundLevel, settings: Settings, warn: Callable[[str], None]
) -> NDArray[np.int32]:
    """Label the cells that stand above the ground, one label per object (fine filter).

    The toe that is cut off here is found again around each object.

    Returns
    -------
    labels
        Shape ``(rows * columns,)``: the object of each cell, the largest 0; -1 for none.

    """
    if ground.hills is not None:
        return _of_points(ground.hills, grid)
    heights = grid.heights_m.ravel()
    x, y = grid.centers_m()
    above = np.flatnonzero(heights > ground.surface_m.ravel() + given(settings.margin_m))
    cells = np.column_stack([x.ravel()[above], y.ravel()[above], heights[above]])
    kept = _in_company(cells, settings)
    labels = np.full(len(heights), -1, dtype=np.int32)
    if not settings.stages.fine_cluster:
        labels[above[kept]] = 0
        return labels
    labels[above[kept]] = find_clusters(cells[kept], settings.stages.link_m, settings)
    gap, fewest = _things(grid, settings.stages)
    labels = _native.label_components(labels.reshape(grid.heights_m.shape), gap, fewest)
    labels = _of_points(labels, grid)
    _warn_of_dropped(labels, above, settings, warn)
    if settings.stages.select == "largest":
        labels[labels > 0] = -1
    return labels


def _of_points(labels: NDArray[np.int32], grid: HeightMap) -> NDArray[np.int32]:
    """Return the labels without objects of too few points, since one triangle fills many cells."""
    held = labels >= 0
    points = np.bincount(labels[held], weights=grid.counts.ravel()[held], minlength=1)
    return np.where(held & (points[labels] >= FEWEST_POINTS), labels, np.int32(-1))


def _in_company(cells: NDArray[np.float64], settings: Settings) -> NDArray[np.bool_]:
    """Return which cells the second radius filter keeps."""
    radius_m = given(settings.stages.fine_radius_m)
    if radius_m == 0.0:
        return np.ones(len(cells), dtype=np.bool_)
    fewest = settings.stages.min_neighbors
    return radius_outlier_mask(cells, radius_m, fewest, threads=settings.threads)


def _steps(grid: HeightMap, length_m: float | None) -> int:
    """Return the number of cells that a length reaches across, at most the whole grid."""
    return math.ceil(min(given(length_m) / grid.cell_m, float(max(grid.heights_m.shape))))


def _things(grid: HeightMap, stages: Stages) -> tuple[int, int]:
    """Return the largest gap within one object, in cells, and the fewest cells of an object."""
    return max(_steps(grid, stages.link_m) - 1, 0), stages.min_cluster_size


def _warn_of_dropped(
    labels: NDArray[np.int32],
    above: NDArray[np.intp],
    settings: Settings,
    warn: Callable[[str], None],
) -> None:
    """Warn about cells above the ground that are not measured."""
    dropped = labels[above] != 0 if settings.stages.select == "largest" else labels[above] < 0
    share = dropped.mean() if len(above) else 0.0
    if settings.stages.select == "largest" and share > 0.0:
        count = labels.max() + 1
        warn(f"the largest of {count} objects was measured: {share:.0%} of the cells were dropped")
    elif share > LOOSE_SHARE:
        warn(
            f"{share:.0%} of the cells above the ground belong to no object of "
            f"{settings.stages.min_cluster_size} cells or more"
        )


@dataclass(frozen=True, eq=False)
class Measured:
    """Objects as the kernel returns them, and their bases.

    Attributes
    ----------
    base_m
        Shape of the grid: the base below each cell that was measured, NaN elsewhere.
    compared
        Names of the bases for which each object has a volume.
    regions
        The outlines by label; empty if objects were searched for.
    spread
        How far an earlier scan differs from this one over unchanged ground.

    """

    objects: list[_native.RawObject]
    base_m: NDArray[np.float64]
    compared: tuple[str, ...]
    regions: tuple[Region, ...] = ()
    spread: Spread = NO_SPREAD


def measure_objects(
    surface: Surface,
    grid: HeightMap,
    labels: NDArray[np.int32],
    bases: Bases,
    settings: Settings,
) -> Measured:
    """Integrate each object above its base, its toe included. The surface is handed over.

    Touching piles are split; boxes end where the points on their flat top end.
    """
    found = _native.measure_objects(
        grid.heights_m,
        grid.origin_m,
        grid.cell_m,
        _found(labels, bases, surface),
        measuring(grid, bases, settings),
    )
    return Measured(*found, tuple(bases.compared))


def _found(labels: NDArray[np.int32], bases: Bases, surface: Surface) -> Found:
    """Return what was found in a height map, as the kernel takes it."""
    is_ground = bases.ground.is_ground
    ground = labels < 0 if is_ground is None else is_ground
    return labels, ground, surface.handed_over()


def measure_regions(
    surface: Surface,
    grid: HeightMap,
    regions: Sequence[Region],
    bases: Bases,
    settings: Settings,
) -> Measured:
    """Integrate everything inside each outline, exactly to the line.

    The surface is handed over.
    """
    outline = name_of(settings.outline or "inside")
    rings = [[ring.tolist() for ring in region.rings] for region in regions]
    hills = bases.ground.hills
    labels = np.full(grid.heights_m.size, -1, dtype=np.int32) if hills is None else hills
    try:
        found = _native.measure_inside(
            grid.heights_m,
            grid.origin_m,
            grid.cell_m,
            rings,
            _found(labels, bases, surface),
            measuring(grid, bases, settings),
        )
    except DivespotError as error:
        raise DivespotError(f"{outline}: {error}") from None
    return Measured(*found, tuple(bases.compared), tuple(regions))


def measuring(grid: HeightMap, bases: Bases, settings: Settings) -> Measuring:
    """Return the settings for measuring objects, as the kernel takes them."""
    ground, toe_cells = bases.ground, _steps(grid, settings.stages.toe_m)
    level = (ground.height_m, ground.noise_m, ground.noise_m)
    lengths = toe_cells, settings.stages.annulus_share, given(settings.margin_m)
    things = _things(grid, settings.stages)
    return *lengths, level, things, bases.raw(), settings.threads
