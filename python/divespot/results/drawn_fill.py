"""Heights drawn where nothing was seen; volumes use the estimator's own filling."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def filled(heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a map without gaps, filled with means of the smallest block that holds a height.

    Push and pull over a pyramid (Gortler et al., The Lumigraph, 1996, section 3.4), smoothed once
    on each level; all NaN if nothing was seen.
    """
    if min(heights_m.shape) <= 1 or not np.isnan(heights_m).any():
        return heights_m.copy()
    coarse = filled(_halved(heights_m))
    rows, columns = heights_m.shape
    larger = _smoothed(np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1))[:rows, :columns]
    return np.where(np.isnan(heights_m), larger, heights_m)


def _halved(heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    return thinned(heights_m, 2)


def thinned(heights_m: NDArray[np.float64], step: int) -> NDArray[np.float64]:
    """Return the mean of each block of `step` x `step` cells, NaN if it holds no height."""
    rows, columns = (-(-size // step) * step for size in heights_m.shape)
    padded = np.full((rows, columns), np.nan)
    padded[: heights_m.shape[0], : heights_m.shape[1]] = heights_m
    blocks = padded.reshape(rows // step, step, columns // step, step)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # blocks with only NaN
        return np.asarray(np.nanmean(blocks, axis=(1, 3)))


def _smoothed(heights_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean of each cell and its four neighbours."""
    p = np.pad(heights_m, 1, mode="edge")
    around = p[:-2, 1:-1] + p[2:, 1:-1] + p[1:-1, :-2] + p[1:-1, 2:]
    return np.asarray((heights_m + around) / 5.0)
