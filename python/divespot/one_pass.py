"""One pass over a survey: what a machine needs to add up its part, and the result."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from divespot.accumulator import Accumulator
from divespot.errors import DivespotError
from divespot.io.las_stretches import records_of
from divespot.io.wanted import NOISE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from divespot.io.las_stretches import Layout, Stretch
    from divespot.io.scan import Scan
    from divespot.io.wanted import Wanted

    Corners = tuple[tuple[float, float, float], tuple[float, float, float]]

#: Most voxels held: 45 bytes each, and 120 bytes each while they are measured.
MOST_VOXELS = 2**22


@dataclass(frozen=True)
class Pass:
    """The data needed to read a part of a survey: filters, and the voxels to add to.

    `metres` is the number of metres per unit of the files along x, y and z; `within` holds the
    corners of a crop. With `skip_damaged`, unreadable stretches are left out and counted.
    """

    origin_m: tuple[float, float, float]
    voxel_m: float
    metres: tuple[float, float, float]
    wanted: Wanted
    within: Corners | None
    skip_damaged: bool = False

    def nothing(self) -> Part:
        """Return the part of no stretch."""
        voxels = Accumulator(self.voxel_m, origin_m=self.origin_m, most=MOST_VOXELS)
        return Part(voxels)

    def records_of(self, stretch: Stretch, part: Part) -> NDArray[np.uint8] | None:
        """Read a stretch; None if it is damaged and `skip_damaged` is set.

        Raises
        ------
        DivespotError
            The stretch is damaged and `skip_damaged` is not set.

        """
        try:
            return records_of(stretch)
        except DivespotError as err:
            if not self.skip_damaged:
                raise
            part.lose(stretch, str(err))
            return None

    def take(self, records: NDArray[np.uint8], layout: Layout, part: Part) -> None:
        """Add records to a part."""
        raw = (layout.size, layout.is_extended, layout.scales, layout.offsets, self.metres)
        wanted = (self.classes, self.wanted.returns, self.within)
        part.take(*part.voxels.add_records(records, raw, wanted))

    @property
    def classes(self) -> bytes:
        """For each class 0 if it is wanted, 1 if it is noise, 2 if it is not wanted."""
        asked = self.wanted.classes
        if asked is None:
            return bytes(int(number in NOISE) for number in range(256))
        return bytes(0 if number in asked else 2 for number in range(256))


@dataclass(eq=False)
class Part:
    """The sum of some stretches.

    `counts` are numbers of points: wanted, outside the crop, withheld, noise, of other classes or
    returns. `damaged` maps files with unreadable points to their number and the error.
    """

    voxels: Accumulator
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(5, np.int64))
    classes: NDArray[np.int64] = field(default_factory=lambda: np.zeros(256, np.int64))
    damaged: dict[str, tuple[int, str]] = field(default_factory=dict)

    def take(self, counts: Sequence[int], classes: Sequence[int]) -> None:
        """Add the counts of a stretch."""
        self.counts += np.array(counts, np.int64)
        self.classes += np.array(classes, np.int64)

    def merge(self, other: Part) -> None:
        """Add another part."""
        self.voxels.merge(other.voxels)
        self.counts += other.counts
        self.classes += other.classes
        for path, lost in other.damaged.items():
            self._lose(path, *lost)

    def lose(self, stretch: Stretch, why: str) -> None:
        """Count the points of an unreadable stretch."""
        self._lose(stretch.path, stretch.count, why)

    def _lose(self, path: str, count: int, why: str) -> None:
        before, other = self.damaged.get(path, (0, why))
        self.damaged[path] = before + count, min(why, other)

    def lost(self) -> tuple[str, ...]:
        """Return a sentence for each damaged file."""
        each = sorted(self.damaged.values(), key=lambda lost: lost[1])
        return tuple(f"{why}: {count} of its points were left out" for count, why in each)


@dataclass(frozen=True, eq=False)
class Plan:
    """How a survey is read: its stretches in any order, and what was sampled before.

    `left_out` are files that cannot be read, one sentence each.
    """

    stretches: tuple[Stretch, ...]
    way: Pass
    sample: Scan
    left_out: tuple[str, ...] = ()
