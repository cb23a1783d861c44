"""Whether coordinates fit a unit that the file does not state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot import _native
from divespot.errors import DivespotError
from divespot.io.no_data import without_no_data
from divespot.io.steps import SAMPLE, steps

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: A scene wider than this, in metres, is a landscape, or not in metres.
WIDEST_M = 3000.0

#: A scan in degrees is narrower than this, many times higher than wide, and not at the origin.
WIDEST_DEG, TIMES_HIGHER, TIMES_FARTHER = 0.05, 20.0, 20.0

#: Integers that span at least this many units are likely millimetres.
FEWEST_UNITS = 100.0


@dataclass(frozen=True, eq=False)
class Judged:
    """Numbers with NaN for no-data heights, their rounding steps, and warnings."""

    xyz: NDArray[Any]
    quantum: NDArray[np.float64]
    warnings: tuple[str, ...]


def judged(xyz: NDArray[Any], unit: str, *, stated: bool) -> Judged:
    """Check coordinates in the unit `unit`, which was stated or assumed.

    Raises
    ------
    DivespotError
        The unit was not stated, and the numbers are degrees.

    """
    if not len(xyz):
        return Judged(xyz, np.zeros(3), ())
    # Corrupt values near the largest float overflow; a later stage drops or refuses them.
    with np.errstate(all="ignore"):
        xyz, no_data = without_no_data(xyz)
        doubts = () if stated else doubts_of(xyz)
        quantum, rounded = steps(xyz, unit)
    return Judged(xyz, quantum, (*no_data, *doubts, *rounded))


def doubts_of(xyz: NDArray[Any]) -> tuple[str, ...]:
    """Return reasons why the unit may not be the metre, one sentence each.

    Raises
    ------
    DivespotError
        The numbers are degrees.

    """
    low, high = _bounds(xyz)
    extent = high - low
    if _are_degrees(low, high):
        raise DivespotError(
            f"its x and y span {extent[0]:.2g} by {extent[1]:.2g} and lie at {low[0]:.6g}, "
            f"{low[1]:.6g}, its z spans {extent[2]:.3g}, as longitude and latitude in degrees do: "
            "a projection to metres is needed, or the unit"
        )
    told = []
    if extent.max() >= FEWEST_UNITS and _whole(xyz):
        told.append(
            f"its coordinates are whole numbers that span {extent.max():g}: if they are "
            "millimetres, --unit mm is needed"
        )
    elif max(extent[:2]) > WIDEST_M:
        told.append(
            f"it is {max(extent[:2]):.4g} m wide if its unit is the metre: if not, a unit is needed"
        )
    return tuple(told)


def _bounds(xyz: NDArray[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of the box around all finite points."""
    lowest, highest, _, _ = _native.outermost(xyz, 0)
    low, high = np.array(lowest), np.array(highest)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        known = xyz[np.isfinite(xyz).all(axis=1)]
        if not len(known):
            return np.zeros(3), np.zeros(3)
        return known.min(axis=0).astype(np.float64), known.max(axis=0).astype(np.float64)
    return low, high


def _are_degrees(low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    extent = high - low
    far = max(abs(low[0]), abs(low[1]))
    on_earth = max(abs(low[0]), abs(high[0])) <= 180.0 and max(abs(low[1]), abs(high[1])) <= 90.0
    width = max(extent[:2])
    narrow = 0.0 < width < WIDEST_DEG and width * TIMES_FARTHER < far
    return bool(on_earth and narrow and extent[2] > TIMES_HIGHER * width)


def _whole(xyz: NDArray[Any]) -> bool:
    some = xyz[:: max(len(xyz) // SAMPLE, 1)]
    known = some[np.isfinite(some)]
    return bool((known == np.rint(known)).all())
