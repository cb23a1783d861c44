"""Comparing two surveys of a place."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from divespot._arguments import require_kind, switch
from divespot.errors import DivespotError
from divespot.intake import load
from divespot.io import UNITS
from divespot.pipeline import measure_cloud
from divespot.progress import Progress
from divespot.results.alignment import align
from divespot.results.comparison import Change, Comparison, Match, Place, changed
from divespot.results.crs_name import crs_name
from divespot.results.pile_matching import labels, matched
from divespot.results.telling import counted
from divespot.settings import Settings
from divespot.surface import NO_GROUND

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray
    from typing_extensions import Unpack

    from divespot._typed import Changes
    from divespot.doors import Report
    from divespot.intake import Cloud, Scannable, Source
    from divespot.report import Pile
    from divespot.results.alignment import Alignment

WITHOUT_GROUND = "no ground is in view: only what changed was measured, no pile of this scan"

#: An earlier scan is raised where the plane is off by more than so many standard uncertainties.
SURE = 2.0


def compare(
    before: Scannable,
    after: Scannable,
    settings: Settings | None = None,
    *,
    do_align: bool = True,
    on_stage: Callable[[str], None] | None = None,
    **changes: Unpack[Changes],
) -> Comparison:
    """Tell what was gained and lost between two scans of a place.

    Both are in one frame; x and y are taken as they are. In height the earlier scan is raised, and
    turned by what a plane allows, so that ground lies on ground where neither survey shows a pile
    (see `divespot.results.alignment`); how sure that is goes into every u95.

    Parameters
    ----------
    before, after
        Paths of scans, or points, as `divespot.measure` takes them.
    settings, **changes
        As `divespot.measure` takes them; `base` says what the piles of each survey stand on.
    do_align
        Raise the earlier scan; without, heights are taken as they are too.
    on_stage
        Called with the name of each stage as it begins.

    Raises
    ------
    DivespotError
        A scan cannot be measured, or the two are in different coordinate systems.

    Examples
    --------
    >>> from dataclasses import replace
    >>> import divespot
    >>> from divespot import simulate
    >>> monday = simulate.scene_named("three-piles")
    >>> tuesday = replace(monday, piles=monday.piles[1:])  # the first of them, 0.035 m3, is gone
    >>> scans = (simulate.scan(day, density=0.03).points for day in (monday, tuesday))
    >>> found = divespot.compare(*scans)
    >>> [match.state for match in found.piles]
    ['in both', 'in both', 'gone']
    >>> f"{found.net.volume_m3:.3f} m3"
    '-0.035 m3'

    """
    from tempfile import TemporaryDirectory  # noqa: PLC0415 - slow to import

    if settings is not None:
        require_kind("settings", settings, Settings)
    is_wanted = switch("do_align", do_align)
    s = (settings or Settings()).changed(**changes)
    runs = [Progress(_named(on_stage, name)) for name in ("before", "after")]
    clouds = runs[0]("read", load, before, s), runs[1]("read", load, after, s)
    _refuse_other_system(clouds[0].source, clouds[1].source)
    first, second = (_alone(cloud, s, run) for cloud, run in zip(clouds, runs, strict=True))
    scale = (clouds[0].scale, clouds[0].scale, 1.0)
    points = clouds[0].points * scale + clouds[0].origin_m
    unit_m = UNITS[clouds[1].source.unit]
    with TemporaryDirectory(prefix="divespot-") as folder:
        path = Path(folder) / "before.npy"

        def held_against(earlier: NDArray[np.float64]) -> Report:
            np.save(path, earlier / unit_m)
            run = Progress(_named(on_stage, "change"))
            found = measure_cloud(clouds[1], s.changed(base=f"surface={path}"), run)
            # The file is gone soon.
            return dataclasses.replace(found, settings=found.settings.changed(base=s.base))

        difference = held_against(points)
        found = _alignment(first, second, difference)
        aligned = is_wanted and _is_off(found)
        if aligned:
            difference = held_against(_raised(points, found, difference))
    return _comparison((first, second), clouds, difference, found, aligned=aligned)


def _alone(cloud: Cloud, settings: Settings, run: Progress) -> Report | None:
    """Return the piles of one scan; None where no ground is in view that they could stand on."""
    try:
        return measure_cloud(cloud, settings, run)
    except DivespotError as error:
        if NO_GROUND in str(error):
            return None
        raise


def _named(on_stage: Callable[[str], None] | None, what: str) -> Callable[[str], None] | None:
    return None if on_stage is None else lambda stage: on_stage(f"{what}: {stage}")


def _refuse_other_system(before: Source, after: Source) -> None:
    one, other = crs_name(before.crs), crs_name(after.crs)
    if one and other and one != other:
        raise DivespotError(
            f"BEFORE is in {one}, AFTER in {other}: one coordinate system is needed"
        )


def _alignment(before: Report | None, after: Report | None, difference: Report) -> Alignment:
    """Align on the cells that both surveys call nothing but ground."""
    level = difference.level
    frame, grid = level.frame, level.height_map
    off = grid.heights_m - level.base_m
    for report in (before, after):
        if report is None:
            off[:] = math.nan
            break
        standing = (*report.piles, *report.other_objects)
        off[labels(standing, frame, level) > 0] = math.nan
    return align(off, *grid.centers_m())


def _is_off(found: Alignment) -> bool:
    """Return whether the plane differs from none by more than its uncertainty."""
    values = np.array([found.offset_m, *found.tilt])
    u = np.sqrt(np.diag(found.covariance))
    return bool(found.blocks and (np.abs(values) > SURE * u).any())


def _raised(
    points_m: NDArray[np.float64], found: Alignment, difference: Report
) -> NDArray[np.float64]:
    """Return the earlier scan's points, raised by the plane along up."""
    frame = difference.level.frame
    level = frame.to_level(points_m / frame.metres)
    level[:, 2] += found.raise_m(level[:, 0], level[:, 1])
    return frame.to_scan(level) * frame.metres


def _comparison(
    reports: tuple[Report | None, Report | None],
    clouds: tuple[Cloud, Cloud],
    difference: Report,
    found: Alignment,
    *,
    aligned: bool,
) -> Comparison:
    level, frame = difference.level, difference.level.frame
    before, after = (() if report is None else report.piles for report in reports)
    was, is_now = (labels(piles, frame, level) for piles in (before, after))
    at = labels(difference.piles, frame, level)
    u_m3 = [_u_m3(pile, found, difference) for pile in difference.piles]
    places = tuple(
        _place(pile, u, _over(was, at == pile.id), _over(is_now, at == pile.id))
        for pile, u in zip(difference.piles, u_m3, strict=True)
    )
    groups = matched(was, is_now, (len(before), len(after)))
    pairs = list(zip(difference.piles, u_m3, strict=True))
    gained = [pair for pair in pairs if pair[0].volume_m3 > 0.0]
    lost = [pair for pair in pairs if pair[0].volume_m3 <= 0.0]
    return Comparison(
        before=reports[0],
        after=reports[1],
        sources=(clouds[0].source, clouds[1].source),
        settings=difference.settings,
        places=places,
        piles=tuple(_match(group, before, after) for group in groups),
        gain=_sum(gained),
        loss=_sum(lost),
        net=_sum(pairs),
        alignment=found,
        aligned=aligned,
        warnings=(
            *_warnings(reports, found, aligned=aligned),
            *_not_counted(difference.other_objects),
        ),
    )


def _sum(pairs: Sequence[tuple[Pile, float]]) -> Change:
    return changed([pile for pile, _ in pairs], [u for _, u in pairs])


def _u_m3(pile: Pile, found: Alignment, difference: Report) -> float:
    """Return the standard uncertainty that the alignment leaves to a place's volume."""
    x, y, _ = difference.level.frame.to_level(np.array([pile.centroid_m]))[0].tolist()
    return found.u_m(x, y) * pile.footprint_m2


def _over(numbers: NDArray[np.int64], place: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(np.unique(numbers[place & (numbers > 0)]).tolist())


def _place(pile: Pile, u_m3: float, was: tuple[int, ...], is_now: tuple[int, ...]) -> Place:
    return Place(
        id=pile.id,
        gain_m3=pile.cut_m3,
        loss_m3=pile.fill_m3,
        net=changed([pile], [u_m3]),
        area_m2=pile.footprint_m2,
        max_height_m=pile.max_height_m,
        centroid_m=pile.centroid_m,
        outline_m=pile.outline_m,
        touches_edge=pile.touches_edge,
        piles=is_now,
        piles_before=was,
    )


def _match(
    group: tuple[tuple[int, ...], tuple[int, ...]],
    before: Sequence[Pile],
    after: Sequence[Pile],
) -> Match:
    were = [before[i - 1] for i in group[0]]
    are = [after[i - 1] for i in group[1]]
    volumes = [sum(pile.volume_m3 for pile in piles) for piles in (were, are)]
    u95 = math.hypot(*(pile.u95_m3 for pile in (*were, *are)))
    return Match(*group, volumes[0], volumes[1], Change(volumes[1] - volumes[0], u95))


def _warnings(
    reports: tuple[Report | None, Report | None], found: Alignment, *, aligned: bool
) -> tuple[str, ...]:
    told = []
    for name, report in zip(("before", "after"), reports, strict=True):
        own = (WITHOUT_GROUND,) if report is None else report.warnings
        told += [f"{name}: {text}" for text in own]
    told.append("x and y were taken as they are: both scans must be in one frame")
    if not found.blocks:
        told.append(
            "too little ground was seen in both scans to align them: heights were taken as they "
            "are too, and u95 knows nothing of how well they fit"
        )
    elif aligned:
        told.append(f"the earlier scan was raised by {found.offset_m:.2g} m to lie on the ground")
    return tuple(told)


def _not_counted(others: Sequence[Pile]) -> list[str]:
    """Return a warning of what differs but is no bulk material that came or went."""
    if not others:
        return []
    volume_m3 = sum(abs(item.volume_m3) for item in others)
    reasons = ", ".join(dict.fromkeys(str(item.reason) for item in others))
    places = counted(len(others), "place")
    return [f"{places} that differ, {volume_m3:.2g} m³ in all, are not counted: {reasons}"]
