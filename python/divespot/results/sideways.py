"""Horizontal offset between two scans of a site, from piles that did not change."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot.results.alignment import fitted_robustly
from divespot.results.pile_matching import matched

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.report import Report

#: Errors are correlated over this many cells per side, which leaves fewer independent ones.
TOGETHER = 8

#: Fewest cells for an offset, and the least mean square slope in the direction with the smallest,
#: as a share of that in the direction with the largest: slopes must face all directions.
FEWEST, ACROSS = 10 * TOGETHER**2, 0.1


@dataclass(frozen=True, eq=False)
class Sideways:
    """The offset of the earlier scan from the later one along x and y of the level frame.

    Attributes
    ----------
    shift_m
        Offset of the earlier scan, which is moved back by it if it is significant.
    covariance
        Shape ``(2, 2)``: covariance of the offset.

    """

    shift_m: tuple[float, float]
    covariance: NDArray[np.float64]

    @property
    def u_m(self) -> float:
        """The standard uncertainty of the offset in the direction in which it is largest."""
        return math.sqrt(max(float(np.linalg.eigvalsh(self.covariance)[-1]), 0.0))

    def u_m3(self, rise_m2: tuple[float, float]) -> float:
        """Return the standard uncertainty of a volume with this integral of slopes."""
        rise = np.array(rise_m2)
        return math.sqrt(max(float(rise @ self.covariance @ rise), 0.0))


def sideways(
    off_m: NDArray[np.float64],
    slopes: tuple[NDArray[np.float64], NDArray[np.float64]],
    stood: NDArray[np.bool_],
) -> Sideways | None:
    """Fit the offset to height differences on slopes (Nuth & Kääb, Cryosphere 5:271, 2011).

    `off_m` is the later height less the earlier one after vertical alignment, `stood` the cells of
    unchanged piles. None if there are too few slopes.
    """
    known = stood & ~np.isnan(off_m)
    terms = np.column_stack([slope[known] for slope in slopes])
    if len(terms) < FEWEST:
        return None
    least, most = np.linalg.eigvalsh(terms.T @ terms)
    if least < ACROSS * most or most <= 0.0:
        return None
    values, covariance = fitted_robustly(terms, off_m[known])
    x, y = values.tolist()
    return Sideways((x, y), covariance * TOGETHER**2)


def unchanged(
    reports: tuple[Report, Report], labels: tuple[NDArray[np.int64], NDArray[np.int64]]
) -> NDArray[np.bool_]:
    """Return the cells of piles in both surveys whose volumes agree within their u95."""
    before, after = (report.piles for report in reports)
    stood = np.zeros(labels[0].shape, dtype=np.bool_)
    for old, new in matched(*labels, (len(before), len(after))):
        if len(old) == len(new) == 1:
            one, other = before[old[0] - 1], after[new[0] - 1]
            if abs(one.volume_m3 - other.volume_m3) <= math.hypot(one.u95_m3, other.u95_m3):
                stood |= (labels[0] == one.id) & (labels[1] == other.id)
    return stood
