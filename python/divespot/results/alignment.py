"""How two scans of a place lie to each other, from the ground that did not change."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: From the median absolute deviation to the standard deviation of a normal distribution.
NMAD = 1.4826

#: Standard deviations that a two-sided test of 95 % allows for.
LEVEL_95 = 1.96

#: Cells farther from the plane than so many standard deviations changed (Tukey's biweight).
TUKEY = 4.685

#: Stable ground is looked at in so many blocks a side: within one, errors go together.
BLOCKS = 12

#: With fewer blocks of stable ground nothing is aligned; with fewer, nothing is turned.
FEWEST, FEWEST_TO_TURN = 6, 24

_ROUNDS = 20


@dataclass(frozen=True, eq=False)
class Alignment:
    """The heights by which the earlier scan was raised: a plane over the level frame.

    Attributes
    ----------
    offset_m
        In the middle of the stable ground.
    tilt
        Slope along x and y.
    middle_m
        Where that is.
    covariance
        Shape ``(3, 3)``: of offset and slopes.
    blocks
        Blocks of stable ground that it rests on; 0 where nothing was aligned.
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
        """The least change of one cell's height that is told from none (95 %).

        Lane, Westaway & Hicks, Earth Surf. Process. Landforms 28:249 (2003).
        """
        return LEVEL_95 * self.spread_m

    def raise_m(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return by how much the earlier scan is raised at a place."""
        slopes = self.tilt[0] * (x_m - self.middle_m[0]) + self.tilt[1] * (y_m - self.middle_m[1])
        return np.asarray(self.offset_m + slopes)

    def u_m(self, x_m: float, y_m: float) -> float:
        """Return the standard uncertainty of that."""
        at = np.array([1.0, x_m - self.middle_m[0], y_m - self.middle_m[1]])
        return math.sqrt(max(float(at @ self.covariance @ at), 0.0))


def align(
    difference_m: NDArray[np.float64], x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> Alignment:
    """Fit a plane to the differences on stable ground, robustly: some of it may have changed.

    All of shape ``(rows, columns)``; NaN where the ground is not stable or was not seen twice.
    How sure the plane is follows from the spread of the blocks' means, not of the cells:
    neighbouring cells err together.
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
    """Return a standard deviation that few changes do not reach."""
    return float(NMAD * np.median(np.abs(values - np.median(values)))) if len(values) else math.nan


def _blocks(
    difference_m: NDArray[np.float64], x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the median difference of each block that holds enough, and where it lies."""
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
    if (terms[:, 0] == 1.0).all():  # the first is an offset, of which the median knows most
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
