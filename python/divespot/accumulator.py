"""Any number of points added up in voxels, in bounded memory and in any order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot import _native
from divespot._arguments import as_floats, number, require_kind, whole
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    _Triple = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Held:
    """The content of all voxels, in an order independent of the order of the points.

    Attributes
    ----------
    means
        Shape ``(n, 3)``: the mean position of the points in each voxel, in metres.
    counts
        Shape ``(n,)``: the number of points in each voxel.
    bounds_m
        Shape ``(n, 2)``: the lowest and the highest z of the points in each voxel.

    """

    means: NDArray[np.float64]
    counts: NDArray[np.uint32]
    bounds_m: NDArray[np.float64]


class Accumulator:
    """Voxels with counts and sums of the points in them.

    Sums are of integers: the same points give the same bits in any order, in any chunks, and merged
    from any number of machines. Voxels begin with an edge of `voxel_m`; whenever more than `most`
    of them are occupied, all edges are doubled. The final edge is the finest of these at which
    `most` voxels suffice. An occupied voxel takes about 45 bytes; empty ones none.

    Parameters
    ----------
    voxel_m
        The smallest edge of a voxel, in metres.
    origin_m
        A corner of a voxel. Points may be on any side of it, at most 2**34 edges away.
    most
        Largest number of occupied voxels.

    Raises
    ------
    DivespotError
        `voxel_m` is not above 0 or `most` is 0.

    Examples
    --------
    >>> from divespot.scale import Accumulator
    >>> here = Accumulator(0.5)
    >>> here.add([[0.1, 0.1, 0.25], [5.0, 0.0, 0.0]])
    >>> there = here.empty()
    >>> there.add([[0.4, 0.1, 0.25]])
    >>> here.merge(Accumulator.from_bytes(there.to_bytes()))
    >>> here.points, here.voxels, here.held().counts.tolist()
    (3, 2, [2, 1])

    """

    def __init__(
        self, voxel_m: float, *, origin_m: Sequence[float] = (0.0, 0.0, 0.0), most: int = 2**22
    ) -> None:
        if len(origin_m) != 3:
            raise DivespotError(f"origin_m has {len(origin_m)} numbers: three are needed")
        x, y, z = (number("origin_m", value) for value in origin_m)
        edge_m = number("voxel_m", voxel_m)
        self._raw = _native.RawAccumulator((x, y, z), edge_m, whole("most", most))

    @classmethod
    def _of(cls, raw: _native.RawAccumulator) -> Accumulator:
        own = cls.__new__(cls)
        own._raw = raw  # noqa: SLF001 - an instance of this class
        return own

    @classmethod
    def from_bytes(cls, data: bytes) -> Accumulator:
        """Return the accumulator that `to_bytes` serialized.

        Raises
        ------
        DivespotError
            The bytes are not of an accumulator, or of one of another version.

        """
        if not isinstance(data, bytes):
            raise DivespotError(f"data is a {type(data).__name__}: bytes are needed")
        return cls._of(_native.RawAccumulator.from_bytes(data))

    def to_bytes(self) -> bytes:
        """Return the accumulator as bytes; the same voxels give the same bytes."""
        return self._raw.to_bytes()

    def blocks(self) -> list[tuple[tuple[int, int, int], bytes]]:
        """Return what cubes of 128 voxels hold: each its place from the origin, and its bytes.

        `from_bytes` makes accumulators of these, which can be merged. Points that were dropped are
        counted in none of them.
        """
        return self._raw.blocks()

    def __reduce__(self) -> tuple[Callable[[bytes], Accumulator], tuple[bytes]]:
        return Accumulator.from_bytes, (self.to_bytes(),)

    def empty(self) -> Accumulator:
        """Return an accumulator with the same voxels and no points, to be merged into this one."""
        return self._of(self._raw.empty())

    def add(self, points: ArrayLike) -> None:
        """Add points of shape ``(n, 3)``; those not finite or all zero are dropped and counted.

        Raises
        ------
        DivespotError
            `points` have the wrong shape or type, or a point is too far from the origin.

        """
        self._raw.add(as_floats("points", points))

    def add_records(
        self,
        records: NDArray[np.uint8],
        layout: tuple[int, bool, _Triple, _Triple, _Triple],
        kept: tuple[bytes, str, tuple[_Triple, _Triple] | None],
    ) -> tuple[list[int], list[int]]:
        """Add LAS records as they are in a file; return how many were kept and left out.

        Parameters
        ----------
        records
            The bytes of whole records, which no other thread writes to.
        layout
            Bytes per record, whether its format is 6 or higher, scales, offsets, metres per unit.
        kept
            For each class 0: keep, 1: noise, 2: leave out; which returns to keep; the crop box.

        Returns
        -------
        counts
            Numbers of points: kept, outside the box, withheld, noise, of other classes or returns.
        classes
            Number of points of each class.

        """
        return self._raw.add_records(records, layout, kept)

    def merge(self, other: Accumulator) -> None:
        """Add the content of another accumulator.

        Raises
        ------
        DivespotError
            The other accumulator has other voxels.

        """
        require_kind("other", other, Accumulator)
        self._raw.merge(other._raw)

    def held(self) -> Held:
        """Return the content of each voxel."""
        return Held(*self._raw.held(joined=False))

    def surfaces(self) -> Held:
        """Return the content of voxels, merging two of a column if a surface lies on their face."""
        return Held(*self._raw.held(joined=True))

    @property
    def voxel_m(self) -> float:
        """Present edge of the voxels."""
        return self._raw.voxel_m

    @property
    def voxels(self) -> int:
        """Number of occupied voxels."""
        return self._raw.voxels

    @property
    def points(self) -> int:
        """Number of points in them."""
        return self._raw.points

    @property
    def dropped(self) -> tuple[int, int]:
        """Number of points that were dropped: not finite, and at (0, 0, 0)."""
        nonfinite, zero = self._raw.dropped
        return nonfinite, zero
