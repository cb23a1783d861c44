"""One pass over a survey: what a machine needs to add up its part, and the result."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from divespot.accumulator import Accumulator
from divespot.blocks import Blocks
from divespot.errors import DivespotError
from divespot.io.las_stretches import records_of
from divespot.io.wanted import NOISE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from divespot.blocks import At
    from divespot.io.las_stretches import Layout, Stretch
    from divespot.io.scan import Scan
    from divespot.io.wanted import Wanted

    Corners = tuple[tuple[float, float, float], tuple[float, float, float]]

#: Most voxels held: 45 bytes each, and 120 bytes each while they are measured.
MOST_VOXELS = 2**22

#: Records whose points are added up in fine voxels at once: no more than are held.
AT_ONCE = 2**20


@dataclass(frozen=True)
class Pass:
    """The data needed to read a part of a survey: filters, and the voxels to add to.

    `voxel_m` is the edge of the voxels that the whole survey is held in, `fine_m` that of those it
    is measured in part by part; None where it is not. `metres` are those to the files' unit along
    x, y and z, `within` the corners of a crop. With `skip_damaged`, stretches that cannot be read
    are left out, and counted.
    """

    origin_m: tuple[float, float, float]
    voxel_m: float
    fine_m: float | None
    metres: tuple[float, float, float]
    wanted: Wanted
    within: Corners | None
    skip_damaged: bool = False

    def nothing(self) -> Part:
        """Return what no stretch gives."""
        return Part(self._voxels(self.voxel_m))

    def blocks(self) -> Blocks | None:
        """Return where fine voxels are kept, if they are."""
        return None if self.fine_m is None else Blocks(self._voxels(self.fine_m), self.origin_m)

    def _voxels(self, edge_m: float) -> Accumulator:
        return Accumulator(edge_m, origin_m=self.origin_m, most=MOST_VOXELS)

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
        part.take(*self._add(records, layout, part.voxels))

    def fine(self, records: NDArray[np.uint8], layout: Layout) -> Iterator[tuple[At, bytes]]:
        """Yield what records add up to in fine voxels, block by block; nothing without any."""
        if self.fine_m is None:
            return
        step = AT_ONCE * layout.size
        for begin in range(0, len(records), step):
            voxels = self._voxels(self.fine_m)
            self._add(records[begin : begin + step], layout, voxels)
            yield from voxels.blocks()

    def _add(
        self, records: NDArray[np.uint8], layout: Layout, voxels: Accumulator
    ) -> tuple[list[int], list[int]]:
        raw = (layout.size, layout.is_extended, layout.scales, layout.offsets, self.metres)
        return voxels.add_records(records, raw, (self.classes, self.wanted.returns, self.within))

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
