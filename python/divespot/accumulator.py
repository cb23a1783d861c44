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
    """What voxels hold, in an order that does not depend on how it came there.

    Attributes
    ----------
    means
        Shape ``(n, 3)``: the mean place of the points of each.
    counts
        Shape ``(n,)``: how many points.
    bounds_m
        Shape ``(n, 2)``: the lowest and the highest of their heights.

    """

    means: NDArray[np.float64]
    counts: NDArray[np.uint32]
    bounds_m: NDArray[np.float64]


class Accumulator:
    """Voxels and what their points add up to.

    Sums are of integers: the same points give the same bits in any order, in any chunks, and merged
    from however many machines. Voxels begin with an edge of `voxel_m`; where more than `most` of
    them hold something, all edges are doubled, as often as needed. In the end it is the finest of
    these edges at which `most` voxels suffice. A voxel takes about 45 bytes; empty ones none.

    Parameters
    ----------
    voxel_m
        The smallest edge of a voxel, in metres.
    origin_m
        A corner of a voxel. Points may lie on all sides, at most 2**34 edges away.
    most
        Voxels that are held at most.

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
        own._raw = raw  # noqa: SLF001 - of its own kind
        return own

    @classmethod
    def from_bytes(cls, data: bytes) -> Accumulator:
        """Return what `to_bytes` made bytes of.

        Raises
        ------
        DivespotError
            The bytes are of no accumulator, or of one of another version.

        """
        if not isinstance(data, bytes):
            raise DivespotError(f"data is a {type(data).__name__}: bytes are needed")
        return cls._of(_native.RawAccumulator.from_bytes(data))

    def to_bytes(self) -> bytes:
        """Return all that is held; the same voxels give the same bytes."""
        return self._raw.to_bytes()

    def __reduce__(self) -> tuple[Callable[[bytes], Accumulator], tuple[bytes]]:
        return Accumulator.from_bytes, (self.to_bytes(),)

    def empty(self) -> Accumulator:
        """Return another of the same voxels without points, which can be merged into this one."""
        return self._of(self._raw.empty())

    def add(self, points: ArrayLike) -> None:
        """Add points of shape ``(n, 3)``; those not finite or all zero are dropped and counted.

        Raises
        ------
        DivespotError
            `points` have the wrong shape or type, or one lies too far from the origin.

        """
        self._raw.add(as_floats("points", points))

    def add_records(
        self,
        records: NDArray[np.uint8],
        layout: tuple[int, bool, _Triple, _Triple, _Triple],
        kept: tuple[bytes, str, tuple[_Triple, _Triple] | None],
    ) -> tuple[list[int], list[int]]:
        """Add LAS records as they are in a file; return what was kept of them, and left out.

        Parameters
        ----------
        records
            The bytes of whole records, which nobody else writes to.
        layout
            Bytes of a record, whether of format 6 or higher, scales, offsets, metres to the unit.
        kept
            For each class 0 to keep it, 1 for noise, 2 to leave it out; which returns; a box.

        Returns
        -------
        counts
            Points kept, of those outside the box, withheld, noise, of other classes or returns.
        classes
            Points of each class.

        """
        return self._raw.add_records(records, layout, kept)

    def merge(self, other: Accumulator) -> None:
        """Add what another holds.

        Raises
        ------
        DivespotError
            It is of other voxels.

        """
        require_kind("other", other, Accumulator)
        self._raw.merge(other._raw)

    def held(self) -> Held:
        """Return what each voxel holds."""
        return Held(*self._raw.held(joined=False))

    def surfaces(self) -> Held:
        """Return the same, a surface that the face between two voxels of a column parts as one."""
        return Held(*self._raw.held(joined=True))

    @property
    def voxel_m(self) -> float:
        """Edge of the voxels as they are."""
        return self._raw.voxel_m

    @property
    def voxels(self) -> int:
        """Voxels that hold something."""
        return self._raw.voxels

    @property
    def points(self) -> int:
        """Points that they hold."""
        return self._raw.points

    @property
    def dropped(self) -> tuple[int, int]:
        """Points that were dropped: not finite, and at (0, 0, 0)."""
        nonfinite, zero = self._raw.dropped
        return nonfinite, zero
