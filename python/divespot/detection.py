"""The detection limit of a change, estimated from ground that did not change."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Sizes with fewer blocks are not used.
FEWEST = 6

#: Shares of the block means, and within how many standard deviations of zero they lie if normally
#: distributed. The larger estimate is used: up to a tenth of the ground may have changed.
_SHARES = ((0.6827, 1.0), (0.9, 1.645))

#: Errors are taken as correlated up to the largest block size whose means are off by more than this
#: share of those of the place's own size: independent errors of cells halve from size to size.
ALIKE = 0.5

#: Probability that a comparison without any change lists a place.
FALSE_ALARM = 0.05


@dataclass(frozen=True, eq=False)
class Spread:
    """How far the mean difference over a place is from zero where nothing changed.

    Errors of neighbouring cells are correlated (registered frames, waves of photogrammetry), so
    that the uncertainty of a mean over a place does not fall with the root of its number of cells
    (Rolstad, Haug & Denby, J. Glaciol. 55:666, 2009). It is taken from blocks of stable ground of
    the place's own size, for any kind of error.

    Attributes
    ----------
    edges_m
        Edges of the blocks, ascending; empty where there is too little stable ground.
    u_m
        Standard uncertainty of the mean over a block of each size.
    blocks
        Number of blocks of each size.
    seen_m2
        Area seen in both surveys, in which places are searched for.

    """

    edges_m: tuple[float, ...] = ()
    u_m: tuple[float, ...] = ()
    blocks: tuple[int, ...] = ()
    seen_m2: float = 0.0

    @classmethod
    def of(cls, stable_m: NDArray[np.float64], cell_m: float, seen_m2: float) -> Spread:
        """Estimate from the differences of aligned surveys on stable ground, NaN elsewhere."""
        found = []
        edge, least = 1, math.inf
        while edge <= max(stable_m.shape):
            means = np.abs(_block_means(stable_m, edge))
            if len(means) < FEWEST:
                break
            u = max(float(np.quantile(means, share)) / times for share, times in _SHARES)
            # A larger block cannot be less certain; a change may fill some of a few blocks.
            least = min(least, u)
            found.append((edge * cell_m, least, len(means)))
            edge *= 2
        if not found:
            return cls(seen_m2=seen_m2)
        edges, u_m, blocks = zip(*found, strict=True)
        return cls(edges, u_m, blocks, seen_m2)

    def u_of(self, area_m2: float) -> float:
        """Return the standard uncertainty of the mean difference over a place, 0 if unknown."""
        if not self.edges_m or area_m2 <= 0.0:
            return 0.0
        return float(np.interp(math.sqrt(area_m2), self.edges_m, self.u_m))

    def u_m3(self, area_m2: float, rise_m2: float = 0.0) -> float:
        """Return the standard uncertainty of a volume.

        `rise_m2` is the length of the surface's gradient integrated over the place: the volume
        error is `rise_m2` times the surveys' horizontal offset, taken as large as the vertical
        one.
        """
        return self.u_of(area_m2) * math.hypot(area_m2, rise_m2)

    def clear_by(self, area_m2: float) -> float:
        """Return the number of standard uncertainties from which a place is listed.

        It is set so that in 19 of 20 comparisons without a change no place is listed: as many
        places are tested as blocks of this size were seen (Bonferroni), and the uncertainty is
        known from few blocks (Student; Abramowitz & Stegun 26.7.5), namely blocks as large as the
        errors are correlated, of which a scan of few frames has few.
        """
        from statistics import NormalDist  # noqa: PLC0415 - slow to import

        if not self.edges_m:
            return 0.0
        places = max(self.seen_m2 / area_m2, 1.0) if area_m2 > 0.0 else 1.0
        z = NormalDist().inv_cdf(1.0 - FALSE_ALARM / (2.0 * places))
        freedom = self._independent(area_m2) - 1
        return z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)

    def _independent(self, area_m2: float) -> int:
        """Return the number of independent blocks: of the size over which errors correlate."""
        larger = int(np.searchsorted(self.edges_m, math.sqrt(area_m2)))
        own = min(larger, len(self.edges_m) - 1)
        alike = (n for u, n in zip(self.u_m, self.blocks, strict=True) if u > ALIKE * self.u_m[own])
        return min(alike, default=self.blocks[own])


#: The spread where nothing is known.
NO_SPREAD = Spread()


def _block_means(values: NDArray[np.float64], edge: int) -> NDArray[np.float64]:
    """Return the mean of each square block of which at least half is known."""
    rows, columns = (edge * -(-size // edge) for size in values.shape)
    whole = np.full((rows, columns), np.nan)
    whole[: values.shape[0], : values.shape[1]] = values
    blocks = whole.reshape(rows // edge, edge, columns // edge, edge)
    known = ~np.isnan(blocks)
    counts = known.sum(axis=(1, 3))
    sums = np.where(known, blocks, 0.0).sum(axis=(1, 3))
    held = counts >= max(edge * edge / 2, 1)
    return np.asarray(sums[held] / counts[held])
