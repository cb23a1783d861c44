"""How large a change must be to be told from none: seen where nothing changed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: With fewer blocks of a size nothing is said of that size.
FEWEST = 6

#: Of so many blocks the mean is not farther from none than so many standard deviations of a normal
#: distribution: the larger says how far, and a tenth of the ground may have changed.
_SHARES = ((0.6827, 1.0), (0.9, 1.645))

#: Errors go together up to blocks whose means are off by more than this share of those of smaller
#: ones: errors of single cells halve from one size to the next.
ALIKE = 0.5

#: How often a place may be listed though nothing changed, in a whole comparison.
FALSE_ALARM = 0.05


@dataclass(frozen=True, eq=False)
class Spread:
    """How far the mean difference over a place is from none where nothing changed.

    Neighbouring cells err together (frames that were put together, waves of a surface from
    pictures), so the mean over a place is not as much surer than a cell as it has cells (Rolstad,
    Haug & Denby, J. Glaciol. 55:666, 2009). Blocks of stable ground of the place's own size show
    how sure it is, whatever the errors are.

    Attributes
    ----------
    edges_m
        Edges of the blocks, ascending; empty where there is too little stable ground.
    u_m
        Standard uncertainty of the mean over a block of each.
    blocks
        How many there are of each.
    seen_m2
        Area that was seen in both surveys, on which places are looked for.

    """

    edges_m: tuple[float, ...] = ()
    u_m: tuple[float, ...] = ()
    blocks: tuple[int, ...] = ()
    seen_m2: float = 0.0

    @classmethod
    def of(cls, stable_m: NDArray[np.float64], cell_m: float, seen_m2: float) -> Spread:
        """Look at the differences on stable ground, NaN elsewhere, that are aligned."""
        found = []
        edge, least = 1, math.inf
        while edge <= max(stable_m.shape):
            means = np.abs(_block_means(stable_m, edge))
            if len(means) < FEWEST:
                break
            u = max(float(np.quantile(means, share)) / times for share, times in _SHARES)
            # A larger block is no less sure; what changed may fill some of few.
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

        `rise_m2` is the surface's gradient added up over the place, its length: by it times
        whatever the two surveys lie apart sideways, which is as much as in height, the volume is
        off.
        """
        return self.u_of(area_m2) * math.hypot(area_m2, rise_m2)

    def clear_by(self, area_m2: float) -> float:
        """Return by how many standard uncertainties a place must differ to be listed.

        In a comparison of nothing but the same ground, no place is to be listed in 19 of 20: there
        are as many places to look at as blocks of this size were seen (Bonferroni), and the
        uncertainty is known from few blocks alone (Student; Abramowitz & Stegun 26.7.5). Those are
        as large as errors go together: of a scan put together from a few frames, few.
        """
        from statistics import NormalDist  # noqa: PLC0415 - slow to import

        if not self.edges_m:
            return 0.0
        places = max(self.seen_m2 / area_m2, 1.0) if area_m2 > 0.0 else 1.0
        z = NormalDist().inv_cdf(1.0 - FALSE_ALARM / (2.0 * places))
        freedom = self._independent(area_m2) - 1
        return z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)

    def _independent(self, area_m2: float) -> int:
        """Return how many blocks tell of a place: of the size up to which means err alike."""
        larger = int(np.searchsorted(self.edges_m, math.sqrt(area_m2)))
        own = min(larger, len(self.edges_m) - 1)
        alike = (n for u, n in zip(self.u_m, self.blocks, strict=True) if u > ALIKE * self.u_m[own])
        return min(alike, default=self.blocks[own])


#: Nothing is known of it.
NO_SPREAD = Spread()


def _block_means(values: NDArray[np.float64], edge: int) -> NDArray[np.float64]:
    """Return the mean of each square block of which half is known."""
    rows, columns = (edge * -(-size // edge) for size in values.shape)
    whole = np.full((rows, columns), np.nan)
    whole[: values.shape[0], : values.shape[1]] = values
    blocks = whole.reshape(rows // edge, edge, columns // edge, edge)
    known = ~np.isnan(blocks)
    counts = known.sum(axis=(1, 3))
    sums = np.where(known, blocks, 0.0).sum(axis=(1, 3))
    held = counts >= max(edge * edge / 2, 1)
    return np.asarray(sums[held] / counts[held])
