"""Scans too large for memory: read in one pass, keeping only the means of voxels."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.boxes import overlap
from divespot.cores import cores
from divespot.errors import DivespotError, NothingSeenError
from divespot.io import UNITS, stretches
from divespot.io.las_filter import LasFilter
from divespot.io.las_sample import STRETCH
from divespot.io.las_stretches import stretches_of
from divespot.io.merge import merged, paths_of
from divespot.io.no_data import without_no_data
from divespot.io.scan import Streamed
from divespot.io.wanted import Wanted
from divespot.lengths import CELL
from divespot.log import log
from divespot.one_pass import Pass, Plan
from divespot.spacing import survey
from divespot.too_large import wanted_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from divespot.accumulator import Held
    from divespot.blocks import Blocks
    from divespot.io.las_stretches import Stretch
    from divespot.io.scan import Scan
    from divespot.io.wanted import Rectangle
    from divespot.one_pass import Corners, Part
    from divespot.settings import Settings

#: Number of voxels aimed at. With edges twice as long, a quarter as many are occupied. Measuring
#: them takes seconds, a fraction of the time to decode the smallest scans that are streamed.
AIMED_VOXELS = 2**20

#: Distance between points, times the root of their density, on a surface that they are strewn over.
RANDOM = 1.1

#: Points come in no order where a stretch of them reaches over more than this share of the file's
#: area: rows and flight lines reach over a hundredth, sweeps of a tripod over a quarter.
NO_ORDER = 0.5

#: Stretches of a survey from which the spacing follows, and points that are surveyed of each.
STRETCHES = 40


def streamed(source: Any, settings: Settings) -> Scan:  # noqa: ANN401 - as above
    """Read a survey in one pass, and return the means of its voxels as a scan.

    Raises
    ------
    DivespotError
        A file is damaged or cannot be read, or they are in different systems.

    """
    plan = planned(paths_of(source), settings)
    blocks = plan.way.blocks()
    return scan_of(plan, read(plan, settings.threads, blocks), blocks)


def planned(paths: Sequence[str], settings: Settings, *, skip_damaged: bool = False) -> Plan:
    """Sample a survey: where its points are, and the voxels that suit them.

    With `skip_damaged`, unreadable files are left out and reported.

    Raises
    ------
    DivespotError
        As for `streamed`.

    """
    spread = max(1, STRETCHES // len(paths))
    found = [_found(path, spread, settings, skip_damaged=skip_damaged) for path in paths]
    left_out = [told for told in found if isinstance(told, str)]
    files = [told for told in found if not isinstance(told, str)]
    if not files:
        raise DivespotError(left_out[0])
    sample = merged([look for look, _ in files])
    plan, near = _near(files, sample.crs, settings)
    parts = tuple(stretch for _, own in near for stretch in own)
    seen = np.concatenate([look.points for look, _ in near])
    seen = seen[np.isfinite(seen).all(axis=1)]
    within = _corners(settings, plan, UNITS[sample.unit])
    points = sum(stretch.count for stretch in parts)
    densest_m = (
        _spacing_m(seen, points) if all(_is_shuffled(look) for look, _ in near) else math.inf
    )
    origin_m, spacing_m, voxel_m = _voxels(seen, within, points, densest_m, settings)
    # An earlier scan is held whole, and held against the whole of this one. Cells at least as wide
    # as those of the coarse voxels need no fine ones.
    is_coarse = (settings.cell_m or 0.0) >= CELL * voxel_m
    is_fine = voxel_m > spacing_m and not settings.has_earlier and not is_coarse
    fine_m = spacing_m if is_fine else None
    metres = sample.whole.metres if sample.whole else (1.0, 1.0, 1.0)
    wanted = Wanted.of(None, settings.classes, settings.returns)
    way = Pass(origin_m, voxel_m, fine_m, metres, wanted, within, skip_damaged=skip_damaged)
    return Plan(parts, way, sample, tuple(left_out))


def _near(
    files: Sequence[tuple[Scan, list[Stretch]]], crs: str | None, settings: Settings
) -> tuple[Rectangle | None, Sequence[tuple[Scan, list[Stretch]]]]:
    """Return the rectangle that is read, if it is one, and the files with points in it."""
    looks = [look for look, _ in files]
    plan = wanted_of(settings).rectangle(crs, *_box(looks))
    near = [told for told in files if _meets(told[0], plan)]
    if near or settings.crop is not None:
        return plan, near or files
    # Of outlines that lie elsewhere it is said where they are measured inside of.
    return None, files


def _found(
    path: str, spread: int, settings: Settings, *, skip_damaged: bool
) -> tuple[Scan, list[Stretch]] | str:
    """Return a sample of a file and its stretches; or its error, with `skip_damaged`."""
    try:
        parts = stretches_of(path, wanted_of(settings))
        return stretches(path, spread, unit=settings.unit, crs=settings.crs), parts
    except DivespotError as err:
        if not skip_damaged:
            raise
        return str(err)


def _box(looks: Sequence[Scan]) -> tuple[list[float], list[float]]:
    """Return the corners of the box around files, in their numbers."""
    wholes = [look.whole for look in looks if look.whole is not None]
    low, high = np.array([one.low for one in wholes]), np.array([one.high for one in wholes])
    return low.min(axis=0).tolist(), high.max(axis=0).tolist()


def _meets(look: Scan, plan: Rectangle | None) -> bool:
    """Return whether a file may hold points of a rectangle: by its header, where that is true."""
    if plan is None or look.whole is None:
        return True
    low, high = (np.array(corner) for corner in (look.whole.low, look.whole.high))
    step = 1e-6 * (1.0 + np.abs(high).max())
    seen = look.points / look.whole.metres
    is_true = ((seen >= low - step) & (seen <= high + step))[np.isfinite(seen).all(axis=1)].all()
    return not is_true or overlap((*low[:2], *high[:2]), plan)


def _corners(settings: Settings, plan: Rectangle | None, metres: float) -> Corners | None:
    """Return the corners of a crop, or of the rectangle around outlines, in metres."""
    if plan is None:
        return None
    x0, y0, x1, y1 = plan
    box = settings.crop or (x0, y0, -math.inf, x1, y1, math.inf)
    low, high = (np.array(box).reshape(2, 3) * metres).tolist()
    return _triple(low), _triple(high)


def _triple(numbers: Iterable[float]) -> tuple[float, float, float]:
    x, y, z = map(float, numbers)
    return x, y, z


def _voxels(
    seen: NDArray[np.float64],
    within: Corners | None,
    points: int,
    densest_m: float,
    settings: Settings,
) -> tuple[tuple[float, float, float], float, float]:
    """Return a corner of a voxel, the distance between points, and the edge that is begun with.

    The distance is that in the sample, at most `densest_m`; the edge is larger where that is more
    voxels than are aimed at.
    """
    share = 1.0
    if within is not None:
        inside = ((seen >= within[0]) & (seen <= within[1])).all(axis=1)
        if inside.sum() > STRETCHES:
            share, seen = inside.mean(), seen[inside]
    spacing_m = survey(seen, seed=settings.seed, threads=settings.threads).spacing_m
    spacing_m = min(spacing_m, densest_m)
    width_m, depth_m, _ = np.ptp(seen, axis=0).tolist()
    area_m2 = min(share * points * spacing_m**2, width_m * depth_m)
    edge_m = max(spacing_m, float(np.sqrt(area_m2 / AIMED_VOXELS)))
    return _triple(seen.min(axis=0)), spacing_m, edge_m


def _is_shuffled(look: Scan) -> bool:
    """Return whether a file's points come in no order: a sample is then sparser than all."""
    if look.whole is None:
        return False
    whole = np.subtract(look.whole.high, look.whole.low) * look.whole.metres
    runs = np.array_split(look.points, max(1, len(look.points) // STRETCH))
    reach = np.median([_area(np.ptp(run, axis=0)) for run in runs])
    return bool(reach > NO_ORDER * _area(whole))


def _spacing_m(seen: NDArray[np.float64], points: int) -> float:
    """Return how far apart so many points are, strewn evenly over where a sample of them lies."""
    return RANDOM * math.sqrt(_area(np.ptp(seen, axis=0)) / points)


def _area(sizes_m: NDArray[np.float64]) -> float:
    """Return the area of the largest side of a box."""
    _, depth_m, width_m = np.sort(sizes_m).tolist()
    return float(depth_m * width_m)


def read(plan: Plan, threads: int, blocks: Blocks | None = None) -> Part:
    """Read all stretches on this machine; decoding, reading and adding overlap.

    Fine voxels are kept in `blocks`.

    Raises
    ------
    DivespotError
        As for `streamed`.

    """
    part, adding = plan.way.nothing(), Lock()
    with ThreadPoolExecutor(threads or cores()) as pool:
        each = partial(_read_one, plan.way, part, blocks, adding)
        try:
            for _ in pool.map(each, plan.stretches):
                pass
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    return part


def _read_one(way: Pass, part: Part, blocks: Blocks | None, adding: Lock, stretch: Stretch) -> None:
    records = way.records_of(stretch, part)
    if records is None:
        return
    with adding:
        way.take(records, stretch.layout, part)
    if blocks is not None:
        blocks.put(list(way.fine(records, stretch.layout)))


def scan_of(plan: Plan, part: Part, blocks: Blocks | None = None) -> Scan:
    """Return what a survey adds up to as a scan.

    Raises
    ------
    NothingSeenError
        No point is left after the filters.

    """
    kept, outside, withheld, noise, unwanted = part.counts.tolist()
    counted = {number: n for number, n in enumerate(part.classes.tolist()) if n}
    left_out = LasFilter(plan.way.wanted, unwanted, withheld, noise)
    left_out.seen_classes.update(counted)
    told = left_out.told(kept)
    voxel_m = part.voxels.voxel_m
    nonfinite, zero = part.voxels.dropped
    if not part.voxels.voxels:
        raise NothingSeenError(
            f"{plan.sample.path}: of {kept} points {outside} are outside the crop, {nonfinite} not "
            f"finite and {zero} (0, 0, 0): others are needed"
        )
    means, no_data = _without_no_data(part.voxels.surfaces(), plan.way.metres[2])
    passed = f"its {kept} points were read in one pass and averaged in voxels of {voxel_m:.3g} m"
    log("INFO", f"{len(means)} means of {part.voxels.voxels} voxels of {voxel_m:.4g} m")
    return replace(
        plan.sample,
        points=means,
        warnings=(*plan.sample.warnings, *plan.left_out, *part.lost(), *told, *no_data, passed),
        whole=None,
        streamed=Streamed(kept, nonfinite, zero, voxel_m, blocks),
    )


def _without_no_data(held: Held, metres: float) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return the means of voxels without those at a no-data height, and a warning."""
    in_file = held.means.copy()
    # Sums in integer fractions of an edge are off by micrometres.
    in_file[:, 2] = np.round(in_file[:, 2] / metres, 4)
    seen, told = without_no_data(in_file)
    if not told:
        return held.means, ()
    kept = np.isfinite(seen[:, 2])
    count = held.counts[~kept].sum()
    sentence = f"{count} points share a height far from all others: they were dropped as no data"
    return held.means[kept], (sentence,)
