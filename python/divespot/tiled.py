"""Surveys too large to be held, measured window by window on voxels as fine as their points.

The whole survey, in coarse voxels, tells which way is up and where large objects are. Then every
part of it is measured as a scan of its own, from the fine voxels of a window: tiles that overlap,
and a window for each object that is too large for them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.boxes import box_of, grown, joined, longer, overlap
from divespot.cleaning import cleaned
from divespot.describe import Described, describe
from divespot.errors import DivespotError
from divespot.ground_level import find_ground
from divespot.objects import Measured, measure_regions
from divespot.progress import Progress
from divespot.rounding import Rounding
from divespot.selection import rows_of
from divespot.settings import given
from divespot.sightings import Sighting, every_one_once, is_among
from divespot.standing import measure_standing
from divespot.surface import find_surface, map_heights
from divespot.windows import AROUND, Window, around, tiles

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from divespot.bases import Bases
    from divespot.blocks import Blocks
    from divespot.frame import Frame
    from divespot.intake import Cloud
    from divespot.outline_file import Region
    from divespot.settings import Settings

#: Times that a window is opened wider around an object that runs out of it: each time three times
#: as wide, or more.
WIDER = 3


@dataclass(frozen=True, eq=False)
class Overview:
    """What the whole of a survey shows, and what its windows are measured with.

    Attributes
    ----------
    cloud
        The survey, with its fine voxels.
    blocks
        These.
    places_m
        Shape ``(n, 3)``: the coarse voxels, in the level frame.
    frame
        The way from the level frame to the scan, without gaps.
    bases
        What piles stand on, but for the ground around them.
    regions
        Outlines to measure inside of, if there are any.
    asked
        What was asked for.
    settings
        The settings in force over the whole.

    """

    cloud: Cloud
    blocks: Blocks
    places_m: NDArray[np.float64]
    frame: Frame
    bases: Bases
    regions: tuple[Region, ...]
    asked: Settings
    settings: Settings

    @cached_property
    def _block_boxes_m(self) -> NDArray[np.float64]:
        """Lowest and highest corner of each block in plan, shape ``(n, 4)``."""
        corners_m = self.blocks.corners_m(self.blocks.places())
        level_m = self._level(corners_m.reshape(-1, 3)).reshape(corners_m.shape)[..., :2]
        return np.hstack([level_m.min(axis=1), level_m.max(axis=1)])

    def _level(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.frame.to_level(points_m / self.frame.metres)

    def cloud_of(self, window: Window) -> tuple[Cloud, float]:
        """Return the points of a window, and the edge of the voxels that they are the means of."""
        x0, y0, x1, y1 = window.box_m
        boxes = self._block_boxes_m.T
        near = (boxes[0] <= x1) & (boxes[1] <= y1) & (boxes[2] >= x0) & (boxes[3] >= y0)
        places = self.blocks.places()
        voxels = self.blocks.load(places[row] for row in np.flatnonzero(near).tolist())
        points = voxels.surfaces().means
        level = self._level(points)
        # Far below or above all that counts lies what means no data.
        low_m, high_m = self.places_m[:, 2].min(), self.places_m[:, 2].max()
        room_m = AROUND * self.blocks.voxel_m
        low, high = (x0, y0, low_m - room_m), (x1, y1, high_m + room_m)
        inside = np.asarray(((level >= low) & (level <= high)).all(axis=1))
        scale = (self.cloud.scale, self.cloud.scale, 1.0)
        points = (rows_of(points, inside) - self.cloud.origin_m) / scale
        return replace(self.cloud, points=self.cloud.alter(points)), voxels.voxel_m


@dataclass(frozen=True, eq=False)
class Shown:
    """What windows show: objects that they hold, and those that run out of them."""

    whole: list[Sighting]
    cut: list[Sighting]
    settings: Settings
    points: int
    voxel_m: float


def blocks_of(cloud: Cloud, settings: Settings) -> Blocks | None:
    """Return the fine voxels of a survey that is measured in windows.

    Against an earlier scan, which is held whole, the whole of the survey is held.
    """
    if cloud.streamed is None or settings.has_earlier:
        return None
    blocks: Blocks | None = cloud.streamed.blocks
    return blocks


def for_overview(settings: Settings) -> Settings:
    """Return settings for the whole of a survey: lengths that were given are for its windows."""
    return settings.changed(cell_m=None, radius_m=settings.radius_m and None)


def measure_windows(
    overview: Overview, found: list[Described], run: Progress
) -> tuple[list[Described], Settings]:
    """Measure all windows of a survey, in the whole of which some objects were found.

    Returns
    -------
    found
        All objects, each from the window that shows it best.
    settings
        Those of the window with the most points.

    """
    shown = list(_each(overview, _windows(overview, found), run))
    if not shown:
        return found, overview.settings
    whole = [one for part in shown for one in part.whole]
    if not overview.regions:
        cut = [one for part in shown for one in part.cut]
        whole = _with_cut(overview, every_one_once(whole), cut, len(shown), run)
    edges_m = [part.voxel_m for part in shown]
    least, most = min(edges_m), max(edges_m)
    to = f" to {most:.2g} m" if most > least else ""
    run.warn(f"piles were measured part by part ({len(shown)}), on voxels of {least:.2g} m{to}")
    return [one.found for one in whole], max(shown, key=lambda part: part.points).settings


def _each(overview: Overview, windows: list[Window], run: Progress) -> Iterator[Shown]:
    """Yield what each window shows in which anything can be measured."""
    for number, window in enumerate(windows, 1):
        run.tell(f"windows, {number} of {len(windows)}")
        shown = _shown(overview, window)
        _native.trim_heap()
        if shown is not None:
            yield shown


def _windows(overview: Overview, found: list[Described]) -> list[Window]:
    voxel_m = overview.blocks.voxel_m
    if overview.regions:
        boxes = (box_of(np.concatenate(region.rings)) for region in overview.regions)
        pairs = zip(boxes, overview.regions, strict=True)
        return [around(box_m, voxel_m, region=region) for box_m, region in pairs]
    small = tiles(overview.places_m, voxel_m)
    own = []
    for item in found:
        if item.outline.corners_m:
            box_m = box_of(item.outline.corners_m)
            if not any(tile.holds(box_m) for tile in small):
                own.append(around(box_m, voxel_m, item))
    return [*small, *own]


def _shown(overview: Overview, window: Window) -> Shown | None:
    """Return what a window shows; None where nothing can be measured.

    Then an object for which it was opened stays as it was found.
    """
    cloud, voxel_m = overview.cloud_of(window)
    try:
        found, settings = _found(overview, window, cloud)
    except DivespotError:
        if overview.regions:
            raise
        if window.known is None:
            return None
        found, settings = [window.known], overview.settings
    cell_m = given(settings.cell_m)
    seen = [Sighting.of(item, window, overview.frame, cell_m) for item in found]
    whole = [one for one in seen if overview.regions or not one.is_cut]
    cut = [one for one in seen if one.is_cut]
    return Shown(whole, cut, settings, len(cloud.points), voxel_m)


def _found(overview: Overview, window: Window, cloud: Cloud) -> tuple[list[Described], Settings]:
    """Measure a window as a scan whose pose is known."""
    frame, quiet = overview.frame, Progress(None)
    points, scan, s = cleaned(cloud, overview.asked, quiet)
    surface = find_surface(frame.pose.laid_level(points, s.threads), scan, s)
    del points  # the surface has them, until they are handed over
    grid = map_heights(surface, s)
    ground, s = find_ground(grid, scan, s)
    bases = replace(overview.bases, ground=ground)
    measured: Measured
    if window.region is not None:
        measured = measure_regions(surface, grid, [window.region], bases, s)
    else:
        measured = measure_standing(surface, grid, bases, s, quiet)
    return describe(measured, frame, Rounding.of(cloud, frame.pose, scan), s), s


def _with_cut(
    overview: Overview, whole: list[Sighting], cut: list[Sighting], most: int, run: Progress
) -> list[Sighting]:
    """Add piles that run out of every window that shows them, and were not found in the whole.

    Windows are opened wider around them, not many more than there were: on a hillside all windows
    show something that seems to go on.
    """
    least_m, left_out = 0.5 * AROUND * overview.blocks.voxel_m, 0
    for piece in sorted(cut, key=lambda one: one.rank):
        is_pile = piece.found.pile.reason is None and longer(piece.box_m) >= least_m
        if not is_pile or is_among(piece, whole):
            continue
        found, used = _around(overview, piece) if most > 0 else (None, 0)
        most -= used
        left_out += found is None
        whole = every_one_once([*whole, *(found or ())])
    if left_out:
        run.warn(f"{left_out} parts of something that goes on beyond its windows were not measured")
    return whole


def _around(overview: Overview, piece: Sighting) -> tuple[list[Sighting] | None, int]:
    """Return what wider windows around a part of an object hold, and how many were opened.

    That is None where the object goes on beyond the widest.
    """
    box_m = piece.box_m
    for used in range(1, WIDER + 1):
        shown = _shown(overview, around(grown(box_m, longer(box_m)), overview.blocks.voxel_m))
        if shown is None:
            return [], used
        beyond = [one.box_m for one in shown.cut if overlap(one.box_m, piece.box_m)]
        if not beyond:
            return shown.whole, used
        box_m = joined([box_m, *beyond])
    return None, WIDER
