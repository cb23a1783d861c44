"""Vertical alignment of two scans of a site, on ground that did not change."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Factor from the median absolute deviation to the standard deviation of a normal distribution.
NMAD = 1.4826

#: Number of standard deviations of a two-sided test at 95 %.
LEVEL_95 = 1.96

#: Cells farther from the plane than this many standard deviations get no weight (Tukey's biweight).
TUKEY = 4.685

#: Number of blocks per side for stable ground: errors within a block are correlated.
BLOCKS = 12

#: Fewest blocks of stable ground for an offset, and for a tilt.
FEWEST, FEWEST_TO_TURN = 6, 24

_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Alignment:
    """The plane by which the earlier scan was raised, over the level frame.

    Attributes
    ----------
    offset_m
        Offset in the middle of the stable ground.
    tilt
        Slope along x and y.
    middle_m
        x and y of that middle.
    covariance
        Shape ``(3, 3)``: covariance of offset and slopes.
    blocks
        Number of blocks of stable ground used; 0 if nothing was aligned.
    spread_m
        Standard deviation of the differences of single cells on stable ground.

    """

    offset_m: float
    tilt: tuple[float, float]
    middle_m: tuple[float, float]
    covariance: NDArray[np.float64]
    blocks: int
    spread_m: float

    @property
    def detection_m(self) -> float:
        """The smallest detectable height change of one cell (95 %).

        Lane, Westaway & Hicks, Earth Surf. Process. Landforms 28:249 (2003).
        """
        return LEVEL_95 * self.spread_m

    def raise_m(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return by how much the earlier scan is raised at a position."""
        slopes = self.tilt[0] * (x_m - self.middle_m[0]) + self.tilt[1] * (y_m - self.middle_m[1])
        return np.asarray(self.offset_m + slopes)

    def u_m(self, x_m: float, y_m: float) -> float:
        """Return the standard uncertainty of `raise_m` at a position."""
        at = np.array([1.0, x_m - self.middle_m[0], y_m - self.middle_m[1]])
        return math.sqrt(max(float(at @ self.covariance @ at), 0.0))


def align(
    difference_m: NDArray[np.float64], x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> Alignment:
    """Fit a plane to the differences on stable ground, robust to changes of some of it.

    All arrays have the shape ``(rows, columns)``, with NaN where the ground is not stable or was
    not seen twice. The uncertainty of the plane is taken from the spread of the blocks' means,
    since errors of neighbouring cells are correlated.
    """
    nothing = np.zeros((3, 3))
    spread = _spread(difference_m[~np.isnan(difference_m)])
    means, x, y = _blocks(difference_m, x_m, y_m)
    if len(means) < FEWEST:
        return Alignment(0.0, (0.0, 0.0), (0.0, 0.0), nothing, 0, spread)
    middle = float(x.mean()), float(y.mean())
    terms = np.column_stack([np.ones_like(means), x - middle[0], y - middle[1]])
    kept = 3 if len(means) >= FEWEST_TO_TURN else 1
    values, covariance = fitted_robustly(terms[:, :kept], means)
    whole, nothing[:kept, :kept] = np.zeros(3), covariance
    whole[:kept] = values
    level = difference_m - (whole[0] + whole[1] * (x_m - middle[0]) + whole[2] * (y_m - middle[1]))
    offset, *tilt = whole.tolist()
    spread = _spread(level[~np.isnan(level)])
    return Alignment(offset, (tilt[0], tilt[1]), middle, nothing, len(means), spread)


def _spread(values: NDArray[np.float64]) -> float:
    """Return a robust standard deviation, which a few changes do not affect."""
    return float(NMAD * np.median(np.abs(values - np.median(values)))) if len(values) else math.nan


def _blocks(
    difference_m: NDArray[np.float64], x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the median difference and the position of each block with enough cells."""
    step = max(-(-max(difference_m.shape) // BLOCKS), 1)
    found = []
    for row in range(0, difference_m.shape[0], step):
        for column in range(0, difference_m.shape[1], step):
            part = slice(row, row + step), slice(column, column + step)
            known = ~np.isnan(difference_m[part])
            if known.sum() >= max(step * step // 4, 4):
                of = (difference_m[part][known], x_m[part][known], y_m[part][known])
                found.append([float(np.median(of[0])), float(of[1].mean()), float(of[2].mean())])
    columns = np.array(found).reshape(-1, 3).T
    return columns[0], columns[1], columns[2]


def fitted_robustly(
    terms: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a robust fit and its covariance (iteratively reweighted, Tukey's biweight)."""
    weights = np.ones_like(values)
    fitted: NDArray[np.float64] = np.asarray(np.linalg.lstsq(terms, values, rcond=None)[0])
    if (terms[:, 0] == 1.0).all():  # the first term is an offset: start from the median
        fitted = np.append(np.median(values), np.zeros(terms.shape[1] - 1))
    for _ in range(_ROUNDS):
        off = values - terms @ fitted
        scale = max(_spread(off), 1e-12)
        weights = np.clip(1.0 - (off / (TUKEY * scale)) ** 2, 0.0, None) ** 2
        root = np.sqrt(weights)
        solved = np.linalg.lstsq(terms * root[:, None], values * root, rcond=None)
        fitted = np.asarray(solved[0])
    off = values - terms @ fitted
    freedom = max(float(weights.sum()) - terms.shape[1], 1.0)
    variance = float((weights * off * off).sum()) / freedom
    return fitted, variance * np.linalg.pinv(terms.T @ (terms * weights[:, None]))
