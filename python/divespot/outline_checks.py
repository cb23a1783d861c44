"""Checks of outlines: that they do not overlap, and are not in degrees."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.dot import twice_area
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

#: Number of places, along each side of the box that two outlines share, at which they are compared;
#: and the share of the smaller one that may overlap, since neighbours are drawn inexactly.
LATTICE, SLACK = 40, 0.01

#: Coordinates above this cannot be degrees.
FAR = 1000.0


def first_overlap(
    regions: Sequence[Sequence[NDArray[np.float64]]],
) -> tuple[int, int] | None:
    """Return the first two regions that overlap by more than `SLACK`; None if there are none."""
    lows = np.array([np.concatenate(rings).min(axis=0) for rings in regions]).reshape(-1, 2)
    highs = np.array([np.concatenate(rings).max(axis=0) for rings in regions]).reshape(-1, 2)
    for i, j in sorted(_near(lows, highs)):
        low, high = np.maximum(lows[i], lows[j]), np.minimum(highs[i], highs[j])
        if _overlap(regions[i], regions[j], low, high):
            return i, j
    return None


def _near(lows: NDArray[np.float64], highs: NDArray[np.float64]) -> Iterator[tuple[int, int]]:
    """Yield the pairs of boxes that overlap, by a sweep in order of x."""
    order = np.argsort(lows[:, 0], kind="stable")
    ends = np.searchsorted(lows[order, 0], highs[order, 0])
    for at, (i, end) in enumerate(zip(order.tolist(), ends.tolist(), strict=True)):
        others = order[at + 1 : end]
        beside = (lows[others, 1] < highs[i, 1]) & (highs[others, 1] > lows[i, 1])
        yield from ((min(i, j), max(i, j)) for j in others[beside].tolist())


def _overlap(
    one: Sequence[NDArray[np.float64]],
    other: Sequence[NDArray[np.float64]],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> bool:
    steps = (np.arange(LATTICE) + 0.5) / LATTICE
    x, y = np.meshgrid(*(low[:, None] + (high - low)[:, None] * steps))
    places = np.column_stack([x.ravel(), y.ravel()])
    shared = _native.inside(list(one), places) & _native.inside(list(other), places)
    both = float(shared.mean() * np.prod(high - low))
    return bool(both > SLACK * min(_area(one), _area(other)))


def _area(rings: Sequence[NDArray[np.float64]]) -> float:
    """Return the area of rings: outer ones counter-clockwise, holes clockwise."""
    total = 0.0
    for ring in rings:
        x, y = (ring - ring[0]).T
        total += twice_area(x, y) / 2.0
    return total


def are_degrees(corners: NDArray[np.float64], scan_at: NDArray[np.float64]) -> bool:
    """Return whether corners are longitudes and latitudes and the scan is projected."""
    x, y = np.abs(corners[:, 0]).max(), np.abs(corners[:, 1]).max()
    return bool(x <= 180.0 and y <= 90.0 and np.abs(scan_at[:2]).max() > FAR)


def refuse_degrees(corners: NDArray[np.float64], scan_at: NDArray[np.float64]) -> None:
    """Raise DivespotError if corners are longitudes and latitudes and the scan is projected."""
    if are_degrees(corners, scan_at):
        at = ", ".join(f"{v:.7g}" for v in corners[0, :2])
        scan = ", ".join(f"{v:.7g}" for v in scan_at[:2])
        raise DivespotError(
            f"lies at {at}, as longitude and latitude (WGS 84) do, the scan at {scan}: "
            "the outline in the scan's own system is needed, or a scan that states its system"
        )
