"""The surface: the ground and the material on it, seen from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot import _native
from divespot.clusters import find_clusters, own_clustering
from divespot.errors import NoFloorError
from divespot.grid import HeightMap
from divespot.settings import given, needs_ground

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.settings import Settings
    from divespot.spacing import Survey

    Voxels: TypeAlias = tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.uint32]]
    HandedOver: TypeAlias = list[NDArray[np.float64] | NDArray[np.bool_]]

NO_GROUND = (
    "no ground is in view, only slopes or objects on it: a scan that shows the ground around the "
    "piles is needed, or a base (height=H or surface=FILE)"
)

#: The marks of no points.
NOTHING = np.zeros(0, np.bool_)

#: Edge, in point spacings, of the cells of the walk: each holds several points.
WALKED = 2.0

#: If a floor is given and the walk reaches less than this share of the scene in plan, as between
#: balls or stones wider than a cell, the scene cannot be walked, and all points are used.
WALKABLE = 0.6

#: A cluster of which the walk reached less than this share is apart from the ground.
MUCH = 0.1

#: Edge, in point spacings, of the voxels whose means are clustered: they are a fraction of the
#: points, but on a plane still have neighbours on all sides.
THINNED = 3.0


@dataclass(eq=False)
class Surface:
    """Levelled points, and whether they are on the surface; nothing once they are handed over.

    Attributes
    ----------
    points
        Shape ``(n, 3)``.
    is_on
        Shape ``(n,)``: whether a point is on the surface.
    is_apart
        Shape ``(n,)``: whether it is in a cluster apart from the ground's.

    """

    points: NDArray[np.float64]
    is_on: NDArray[np.bool_]
    is_apart: NDArray[np.bool_]

    @classmethod
    def of_all(cls, points: NDArray[np.float64]) -> Surface:
        """Return points all of which are on the surface."""
        return cls(points, np.ones(len(points), np.bool_), np.zeros(len(points), np.bool_))

    def handed_over(self) -> HandedOver:
        """Return all three to a kernel that frees them once it has used them."""
        handed_over: HandedOver = [self.points, self.is_on, self.is_apart]
        self.points, self.is_on, self.is_apart = self.points[:0].copy(), NOTHING, NOTHING
        return handed_over


def find_surface(points: NDArray[np.float64], scan: Survey, settings: Settings) -> Surface:
    """Walk the surface from the ground; points it cannot reach belong to other objects.

    With a given floor or an outline, the ground need not be in view. With the paper's settings,
    all points are on the surface.

    Raises
    ------
    DivespotError
        No ground is in view.

    """
    if settings.stages.ground_form == "level":
        return Surface.of_all(points)
    few = settings.stages.surface == "triangles"
    cell_m = WALKED * scan.spacing_m if few else given(settings.cell_m)
    anywhere = not needs_ground(settings)
    voxel_m = THINNED * scan.spacing_m
    clustering = own_clustering(settings.radius_m, settings)
    is_on, voxels, labels = _native.surface_and_clusters(
        points, cell_m, scan.roughness_m, anywhere, voxel_m, clustering, settings.threads
    )
    if anywhere and _cells(points[is_on], cell_m) < WALKABLE * _cells(points, cell_m):
        return Surface.of_all(points)
    if labels is None:
        labels = find_clusters(voxels[0], settings.radius_m, settings)
    is_apart = _apart(is_on, voxels, labels)
    is_on &= ~is_apart
    if not is_on.any():
        raise NoFloorError(NO_GROUND)
    return Surface(points, is_on, is_apart)


def _apart(
    is_on: NDArray[np.bool_], voxels: Voxels, labels: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """Return which points are in clusters apart from the ground's (Algorithm 1, line 18).

    The ground's clusters are those that hold much of the points that the walk reached, or of which
    it reached much; of a hovering body it reaches at most a few points that are near the surface.
    Points labelled as noise are left to the walk.
    """
    _, counts, voxel = voxels
    cluster = labels + 1
    # Several times faster than voxel[is_on].
    reached = np.bincount(cluster, np.bincount(voxel.compress(is_on), minlength=len(counts)))
    held = np.bincount(cluster, counts)
    apart = reached < MUCH * np.minimum(held, is_on.sum())
    apart[0] = False
    return np.asarray(apart[cluster][voxel]) if apart.any() else np.zeros(len(voxel), np.bool_)


def _cells(points: NDArray[np.float64], cell_m: float) -> int:
    """Return the number of occupied cells in plan."""
    if not len(points):
        return 0
    cells = np.floor(points[:, :2] / cell_m)
    column, row = (cells - cells.min(axis=0)).clip(max=2.0**31).astype(np.int64).T
    return len(np.unique(column * (row.max() + 1) + row))


def map_heights(surface: Surface, settings: Settings) -> HeightMap:
    """Average the surface's points over the cells of a grid that covers all points."""
    cell_m, triangulated = given(settings.cell_m), settings.stages.surface == "triangles"
    raw = _native.height_map(
        surface.points, cell_m, triangulated, surface.is_on, settings.threads, own=True
    )
    return HeightMap(raw.heights_m, raw.counts, raw.origin_m, cell_m)
