"""One pass over a survey: what a machine needs to add up its part, and what that part is."""

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

#: Voxels that are held at most: 45 bytes each, and 120 each while they are measured.
MOST_VOXELS = 2**22


@dataclass(frozen=True)
class Pass:
    """All that is needed to read a part of a survey: what is wanted, and into which voxels.

    `metres` are those to the files' unit along x, y and z, `within` the corners of a crop. With
    `skip_damaged`, stretches that cannot be read are left out, and counted.
    """

    origin_m: tuple[float, float, float]
    voxel_m: float
    metres: tuple[float, float, float]
    wanted: Wanted
    within: Corners | None
    skip_damaged: bool = False

    def nothing(self) -> Part:
        """Return what no stretch gives."""
        voxels = Accumulator(self.voxel_m, origin_m=self.origin_m, most=MOST_VOXELS)
        return Part(voxels)

    def records_of(self, stretch: Stretch, part: Part) -> NDArray[np.uint8] | None:
        """Read a stretch; None where that fails and may.

        Raises
        ------
        DivespotError
            It fails and may not.

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
        """For each class 0 where it is wanted, 1 where it is noise, 2 where it is not wanted."""
        asked = self.wanted.classes
        if asked is None:
            return bytes(int(number in NOISE) for number in range(256))
        return bytes(0 if number in asked else 2 for number in range(256))


@dataclass(eq=False)
class Part:
    """What some stretches add up to.

    `counts` are points that are wanted, of those outside the crop, withheld, noise, unwanted.
    `damaged` are files with points that cannot be read, how many, and what is wrong with them.
    """

    voxels: Accumulator
    counts: NDArray[np.int64] = field(default_factory=lambda: np.zeros(5, np.int64))
    classes: NDArray[np.int64] = field(default_factory=lambda: np.zeros(256, np.int64))
    damaged: dict[str, tuple[int, str]] = field(default_factory=dict)

    def take(self, counts: Sequence[int], classes: Sequence[int]) -> None:
        """Count what was added."""
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
        """Count the points of a stretch that cannot be read."""
        self._lose(stretch.path, stretch.count, why)

    def _lose(self, path: str, count: int, why: str) -> None:
        before, other = self.damaged.get(path, (0, why))
        self.damaged[path] = before + count, min(why, other)

    def lost(self) -> tuple[str, ...]:
        """Return what is damaged, a sentence a file."""
        each = sorted(self.damaged.values(), key=lambda lost: lost[1])
        return tuple(f"{why}: {count} of its points were left out" for count, why in each)


@dataclass(frozen=True, eq=False)
class Plan:
    """How a survey is read: its stretches in whatever order, and what is known of it before.

    `left_out` are files that cannot be read, a sentence each.
    """

    stretches: tuple[Stretch, ...]
    way: Pass
    sample: Scan
    left_out: tuple[str, ...] = ()
