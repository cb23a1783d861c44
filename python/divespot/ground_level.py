"""The ground: one height, or a surface at several heights, and the hills on it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from divespot import _native
from divespot.errors import NoFloorError
from divespot.kernels import ground_height
from divespot.lengths import by_noise
from divespot.settings import given, needs_ground
from divespot.surface import NO_GROUND

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.grid import HeightMap
    from divespot.settings import Settings
    from divespot.spacing import Survey

    Hills: TypeAlias = tuple[NDArray[np.int32], NDArray[np.bool_], NDArray[np.float64], float]


@dataclass(frozen=True, eq=False)
class GroundLevel:
    """Height of the ground in the level frame, and the noise of its cells.

    Attributes
    ----------
    height_m
        The height of most of the ground.
    noise_m
        Standard deviation of the ground's cells about `surface_m`.
    surface_m
        Shape ``(rows, columns)``: the ground's height in each cell.
    hills
        Shape ``(rows * columns,)``: the hill that each cell belongs to, the largest 0; -1 for none.
        None if objects are found by their height above the ground alone.
    is_ground
        Shape ``(rows * columns,)``: whether a cell is ground; None if `hills` is.
    upside_down
        The same for the surface turned upside down, whose hills are holes; None if holes are not
        wanted.

    """

    height_m: float
    noise_m: float
    surface_m: NDArray[np.float64]
    hills: NDArray[np.int32] | None = None
    is_ground: NDArray[np.bool_] | None = None
    upside_down: GroundLevel | None = None


def find_ground(grid: HeightMap, scan: Survey, settings: Settings) -> tuple[GroundLevel, Settings]:
    """Find the ground's height, surface and noise, and the lengths derived from them.

    Raises
    ------
    DivespotError
        No ground is in view, and no other base was given.

    """
    height = peak_m(grid, settings.base, settings)
    if settings.stages.ground_form == "level":
        ground = _level(grid, height, 2.0 * given(settings.stages.plane_threshold_m))
    else:
        ground = _surface_level(grid, height, scan, settings)
        if needs_ground(settings) and ground.is_ground is not None and not ground.is_ground.any():
            raise NoFloorError(NO_GROUND)
    return ground, by_noise(settings, ground.noise_m)


def _surface_level(
    grid: HeightMap, height_m: float, scan: Survey, settings: Settings
) -> GroundLevel:
    """Return a smooth surface through the ground, continued beneath the objects on it.

    Hills are found on cells as wide as the point spacing. On finer cells the smooth facets of a
    triangulated surface would hide the noise; wider cells would flatten a pile of a dozen points.
    With a given base or an outline, no holes are searched for.
    """
    rows, columns = grid.heights_m.shape
    by = max(1, round(scan.spacing_m / grid.cell_m))
    heights_m = _blocks(grid.heights_m, by)

    with_holes = settings.base == "local" and not settings.is_outlined
    found = _native.hills(heights_m, by * grid.cell_m, with_holes, settings.threads)

    def fine(values: NDArray[Any]) -> NDArray[Any]:
        blocks = values.reshape(heights_m.shape)
        if by > 1:
            blocks = blocks.repeat(by, axis=0).repeat(by, axis=1)
        return np.ascontiguousarray(blocks[:rows, :columns])

    def level(height_m: float, hills: Hills, upside_down: GroundLevel | None) -> GroundLevel:
        labels, is_ground, surface_m, noise_m = hills
        fine_labels, fine_ground = fine(labels).ravel(), fine(is_ground).ravel()
        return GroundLevel(
            height_m, noise_m, fine(surface_m), fine_labels, fine_ground, upside_down
        )

    upside_down = level(-height_m, found[1], None) if with_holes else None
    return level(height_m, found[0], upside_down)


def _blocks(heights_m: NDArray[np.float64], by: int) -> NDArray[np.float64]:
    """Return the mean height of blocks of `by` x `by` cells; NaN where none is known."""
    if by == 1:
        return heights_m
    rows, columns = (-(-size // by) for size in heights_m.shape)
    padded = np.full((rows * by, columns * by), np.nan)
    padded[: heights_m.shape[0], : heights_m.shape[1]] = heights_m
    blocks = padded.reshape(rows, by, columns, by)
    known = ~np.isnan(blocks)
    counts = known.sum(axis=(1, 3))
    sums = np.where(known, blocks, 0.0).sum(axis=(1, 3))
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _level(grid: HeightMap, height_m: float, near_m: float) -> GroundLevel:
    """Return one height; the noise is that of cells below it, since those above may be a pile's."""
    below = height_m - grid.heights_m[grid.heights_m < height_m]
    near = below[below < near_m]
    noise = 1.4826 * float(np.median(near)) if len(near) else 0.0
    return GroundLevel(height_m, noise, np.full(grid.heights_m.shape, height_m))


def peak_m(grid: HeightMap, kind: str, settings: Settings) -> float:
    """Return the height of the histogram's peak, or of the midpoint of its peaks (``midpeak``)."""
    return ground_height(
        grid.heights_m[~np.isnan(grid.heights_m)],
        bin_m=given(settings.stages.bin_m),
        window=settings.stages.window,
        rule="midpoint" if kind == "midpeak" else "lower",
        lower_fraction=settings.stages.lower_fraction,
    )
