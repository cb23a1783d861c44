"""From a levelled cloud to the objects on its ground (paper, Algorithm 3 to Voxel Meshing)."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot import _native
from divespot.clusters import find_clusters
from divespot.errors import DivespotError
from divespot.kernels import radius_outlier_mask
from divespot.mass import mass_kg
from divespot.pose import FLAT_SHARE
from divespot.report import COVERAGE, Budget, Outline, Pile
from divespot.settings import given

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from divespot.bases import Bases
    from divespot.frame import Frame
    from divespot.grid import HeightMap
    from divespot.ground_level import GroundLevel
    from divespot.outline_file import Region
    from divespot.pose import Pose
    from divespot.report import Position
    from divespot.rounding import Rounding
    from divespot.settings import Settings
    from divespot.surface import Surface

    Measuring: TypeAlias = tuple[
        int,
        float,
        float,
        tuple[float, float, float],
        tuple[int, int],
        Sequence[_native.RawBase | None],
        int,
    ]

#: With a base as uncertain as this share of the volume, it does not suit the ground around.
OFF_SHARE = 0.05

#: A summit and its eight neighbours: fewer points have no shape that a pile could be told by.
FEWEST_POINTS = 9

#: With more of what stands above the ground in no object, something may have been missed.
LOOSE_SHARE = 0.25


def find_objects(
    grid: HeightMap, ground: GroundLevel, settings: Settings, warn: Callable[[str], None]
) -> NDArray[np.int32]:
    """Label the cells that stand above the ground, one label an object (fine filter).

    What is cut off here is not lost: the toe is found again around each object.

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
    if not settings.fine_cluster:
        labels[above[kept]] = 0
        return labels
    labels[above[kept]] = find_clusters(cells[kept], settings.link_m, settings)
    gap = max(_steps(grid, settings.link_m) - 1, 0)
    labels = _native.pieces(labels.reshape(grid.heights_m.shape), gap, settings.min_cluster_size)
    labels = _of_points(labels, grid)
    _warn_of_dropped(labels, above, settings, warn)
    if settings.select == "largest":
        labels[labels > 0] = -1
    return labels


def _of_points(labels: NDArray[np.int32], grid: HeightMap) -> NDArray[np.int32]:
    """Return the labels without objects of too few points: triangles fill many cells."""
    held = labels >= 0
    points = np.bincount(labels[held], weights=grid.counts.ravel()[held], minlength=1)
    return np.where(held & (points[labels] >= FEWEST_POINTS), labels, np.int32(-1))


def _in_company(cells: NDArray[np.float64], settings: Settings) -> NDArray[np.bool_]:
    """Return which cells the second radius filter keeps."""
    radius_m = given(settings.fine_radius_m)
    if radius_m == 0.0:
        return np.ones(len(cells), dtype=np.bool_)
    return radius_outlier_mask(cells, radius_m, settings.min_neighbors, threads=settings.threads)


def _steps(grid: HeightMap, length_m: float | None) -> int:
    """Return the cells that a length reaches across, at most the whole grid."""
    return math.ceil(min(given(length_m) / grid.cell_m, float(max(grid.heights_m.shape))))


def _warn_of_dropped(
    labels: NDArray[np.int32],
    above: NDArray[np.intp],
    settings: Settings,
    warn: Callable[[str], None],
) -> None:
    """Say what part of that which stands above the ground is measured nowhere."""
    dropped = labels[above] != 0 if settings.select == "largest" else labels[above] < 0
    share = dropped.mean() if len(above) else 0.0
    if settings.select == "largest" and share > 0.0:
        count = labels.max() + 1
        warn(f"the largest of {count} objects was measured: {share:.0%} of the cells were dropped")
    elif share > LOOSE_SHARE:
        warn(
            f"{share:.0%} of the cells above the ground belong to no object of "
            f"{settings.min_cluster_size} cells or more"
        )


@dataclass(frozen=True, eq=False)
class Measured:
    """Objects as the kernel knows them, and what they stand on.

    Attributes
    ----------
    base_m
        Shape of the grid: the base below each cell that was measured, NaN elsewhere.
    compared
        Names of the bases whose volumes each object has.
    names
        What the outlines are called, by label; empty where objects were found.

    """

    objects: list[_native.RawObject]
    base_m: NDArray[np.float64]
    compared: tuple[str, ...]
    names: tuple[str | None, ...] = ()


def measure_objects(
    surface: Surface,
    grid: HeightMap,
    labels: NDArray[np.int32],
    bases: Bases,
    settings: Settings,
) -> Measured:
    """Integrate each object above its base, its toe included.

    Touching piles are parted; boxes end where the points on their flat top do.
    """
    found = _native.measure_objects(
        grid.heights_m,
        grid.origin_m,
        grid.cell_m,
        labels,
        _is_ground(labels, bases),
        surface.points,
        surface.is_on,
        surface.is_apart,
        measuring(grid, bases, settings),
    )
    return Measured(*found, tuple(bases.compared))


def _is_ground(labels: NDArray[np.int32], bases: Bases) -> NDArray[np.bool_]:
    is_ground = bases.ground.is_ground
    return labels < 0 if is_ground is None else is_ground


def measure_regions(
    surface: Surface,
    grid: HeightMap,
    regions: Sequence[Region],
    bases: Bases,
    settings: Settings,
) -> Measured:
    """Integrate what lies inside each outline, exactly to the line."""
    rings = [[ring.tolist() for ring in region.rings] for region in regions]
    hills = bases.ground.hills
    labels = np.full(grid.heights_m.size, -1, dtype=np.int32) if hills is None else hills
    try:
        found = _native.measure_inside(
            grid.heights_m,
            grid.origin_m,
            grid.cell_m,
            rings,
            labels,
            _is_ground(labels, bases),
            surface.points,
            surface.is_on,
            surface.is_apart,
            measuring(grid, bases, settings),
        )
    except DivespotError as error:
        raise DivespotError(f"{settings.outline}: {error}") from None
    return Measured(*found, tuple(bases.compared), tuple(region.name for region in regions))


def measuring(grid: HeightMap, bases: Bases, settings: Settings) -> Measuring:
    """Return how objects are measured, as the kernels take it."""
    ground, toe_cells = bases.ground, _steps(grid, settings.toe_m)
    level = (ground.height_m, ground.noise_m, ground.noise_m)
    things = (max(_steps(grid, settings.link_m) - 1, 0), settings.min_cluster_size)
    lengths = toe_cells, settings.ring_share, given(settings.margin_m)
    return *lengths, level, things, bases.raw(), settings.threads


def describe(
    measured: Measured, frame: Frame, rounding: Rounding, settings: Settings
) -> tuple[tuple[Pile, ...], tuple[Pile, ...]]:
    """Return piles and other objects, each largest first, placed in the scan's own frame."""
    found = _largest_first(measured.objects)
    described = [_pile(item, measured, frame, rounding, settings) for item in found]
    piles = [item for item in described if item.reason is None]
    others = [item for item in described if item.reason is not None]
    return _numbered(piles), _numbered(others)


def outlines(measured: Measured) -> tuple[Outline, ...]:
    """Return the outlines in the level frame, in the order of `describe`."""
    found = _largest_first(measured.objects)
    return tuple(Outline(tuple(o.outline_m), o.reason) for o in found)


def _largest_first(objects: list[_native.RawObject]) -> list[_native.RawObject]:
    return sorted(objects, key=lambda o: o.fill_m3 - o.cut_m3)


def _numbered(items: list[Pile]) -> tuple[Pile, ...]:
    return tuple(dataclasses.replace(item, id=i) for i, item in enumerate(items, start=1))


def _pile(
    raw: _native.RawObject,
    measured: Measured,
    frame: Frame,
    rounding: Rounding,
    settings: Settings,
) -> Pile:
    def place(position: Position) -> Position:
        x, y, z = frame.to_scan(np.array(position)).tolist()
        return x, y, z

    factor = settings.factor
    terms = [term.name for term in dataclasses.fields(Budget) if hasattr(raw, term.name)]
    own = {term: factor * getattr(raw, term) for term in terms}
    budget = Budget(**own, rounding_m3=factor * rounding.u_m3(raw))
    volume = factor * (raw.cut_m3 - raw.fill_m3)
    mass, u_mass = mass_kg(volume, budget.combined_m3(), settings)
    return Pile(
        id=0,
        volume_m3=volume,
        u95_m3=COVERAGE * budget.combined_m3(),
        cut_m3=factor * raw.cut_m3,
        fill_m3=factor * raw.fill_m3,
        footprint_m2=raw.footprint_m2,
        max_height_m=raw.max_height_m,
        centroid_m=place(raw.centroid_m),
        outline_m=tuple(place(corner) for corner in raw.outline_m),
        seen_fraction=raw.seen_fraction,
        touches_edge=raw.touches_edge,
        leans_on_wall=raw.leans_on_wall,
        mass_kg=mass,
        u95_mass_kg=None if u_mass is None else COVERAGE * u_mass,
        base=raw.base if settings.base == "local" else settings.base.partition("=")[0],
        budget=budget,
        volume_by_base_m3=_by_base(raw, measured, factor),
        name=measured.names[raw.label] if measured.names else None,
        reason=raw.reason,
    )


def _by_base(raw: _native.RawObject, measured: Measured, factor: float) -> dict[str, float] | None:
    if not raw.compared_m3:
        return None
    volumes = (factor * volume for volume in raw.compared_m3)
    return dict(zip(measured.compared, volumes, strict=True))


def doubts(
    piles: tuple[Pile, ...], others: tuple[Pile, ...], pose: Pose, points: int, settings: Settings
) -> list[str]:
    """Return what a user should know before trusting the numbers."""
    found = []
    if not piles:
        nothing = (
            f"nothing of {settings.min_cluster_size} cells or more stands higher than "
            f"margin_m = {settings.margin_m:.2g} above the ground"
        )
        what = f"{len(others)} other objects were found" if others else nothing
        found.append(f"no pile was found: {what}")
    share = pose.plane.inliers / points
    if share < FLAT_SHARE and not settings.base.startswith("surface="):
        found.append(f"only {share:.0%} of the points lie on one plane: the ground may be uneven")
    found += [
        f"object {item.id} may be a pile, but only {item.seen_fraction:.0%} of it were seen: "
        "its volume is an estimate and not in the total"
        for item in others
        if item.reason == "too little seen"
    ]
    for pile in piles:
        found += _doubts_of(pile, settings)
    if settings.density_kg_m3 is not None and not settings.density_u_kg_m3:
        found.append("the density was taken as exact: density_u_kg_m3 is its standard uncertainty")
    return found


def _doubts_of(pile: Pile, settings: Settings) -> list[str]:
    found = []
    if pile.touches_edge:
        found.append(f"pile {pile.id} runs out of the scan: what lies beyond is not counted")
    if pile.base == "ground":
        found.append(f"pile {pile.id} has no ground of its own around it")
    # A height need not be the ground's.
    own = settings.base == "local" or pile.base == "height"
    if not own and pile.budget.base_m3 > OFF_SHARE * abs(pile.volume_m3):
        off_m = pile.budget.base_m3 / pile.footprint_m2
        found.append(
            f"the ground around pile {pile.id} lies about {off_m:.2g} m off the base "
            f"{settings.base}: was another one meant?"
        )
    return found
