"""Matching the piles of two surveys by overlap."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.place_maps import numbered, slopes_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from divespot.frame import Frame
    from divespot.level import Level
    from divespot.report import Pile

#: Piles that overlap by less than this share of the smaller one's area are neighbours.
SHARED = 0.2


def labels(piles: Sequence[Pile], frame: Frame, level: Level) -> NDArray[np.int64]:
    """Return the number of the pile over each cell of a level frame's map, 0 for none.

    `frame` is that of the map; the outlines are in the scan's own frame and unit.
    """
    lines = [
        (pile.id, frame.to_level(np.array(pile.outline_m))) for pile in piles if pile.outline_m
    ]
    return numbered([(number, line[:, :2]) for number, line in lines], level.height_map)


def both_labels(
    before: Sequence[Pile], after: Sequence[Pile], level: Level
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the labels of the piles of two surveys."""
    return labels(before, level.frame, level), labels(after, level.frame, level)


def slopes_between(level: Level) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes of the mean surface of a scan and its base."""
    grid = level.height_map
    return slopes_of(grid.heights_m, level.base_m, grid.cell_m)


def matched(
    before: NDArray[np.int64], after: NDArray[np.int64], counts: tuple[int, int]
) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return groups of overlapping piles: numbers before, and numbers after.

    A pile that was split, or piles that grew together, are one group; groups are in the order of
    the later survey's piles, followed by piles that are gone.
    """
    shared = np.zeros((counts[0] + 1, counts[1] + 1), dtype=np.int64)
    np.add.at(shared, (before.ravel(), after.ravel()), 1)
    smaller = np.minimum.outer(shared.sum(axis=1), shared.sum(axis=0))
    joined = shared >= np.maximum(SHARED * smaller, 1.0)
    joined[0, :] = joined[:, 0] = False
    groups = []
    left = set(range(1, counts[0] + 1))
    done: set[int] = set()
    for number in range(1, counts[1] + 1):
        if number in done:
            continue
        ours, theirs = _group(joined, number)
        groups.append((tuple(sorted(theirs)), tuple(sorted(ours))))
        done |= ours
        left -= theirs
    return [*groups, *(((number,), ()) for number in sorted(left))]


def _group(joined: NDArray[np.bool_], number: int) -> tuple[set[int], set[int]]:
    """Return all piles connected by overlap with a pile of the later survey."""
    ours, theirs, waiting = {number}, set[int](), [number]
    while waiting:
        for one in np.flatnonzero(joined[:, waiting.pop()]).tolist():
            theirs.add(one)
            new = set(np.flatnonzero(joined[one]).tolist()) - ours
            ours |= new
            waiting.extend(new)
    return ours, theirs
