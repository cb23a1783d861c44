"""Voxels too many to be held: kept in files, a block of them each, of which some are loaded."""

from __future__ import annotations

import itertools
import shutil
import tempfile
import weakref
from collections import defaultdict
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot.accumulator import Accumulator
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    #: A block's place from the origin, in blocks.
    At: TypeAlias = tuple[int, int, int]
    Triple: TypeAlias = tuple[float, float, float]

#: Voxels along the edge of a block.
EDGE = 128

#: Bytes that wait to be written, at most: of points in no order, a block's come in small pieces.
WAITING = 2**26

#: Bytes of the length that stands before each piece.
_LENGTH = 8


class Blocks:
    """Voxels in files of a temporary directory, which goes when this does.

    What they hold is sums of integers: whatever came first, the same blocks give the same bits.

    Parameters
    ----------
    nothing
        An accumulator of these voxels.
    origin_m
        Its origin.

    """

    def __init__(self, nothing: Accumulator, origin_m: Triple) -> None:
        self._nothing, self._origin_m = nothing, origin_m
        self._folder = Path(tempfile.mkdtemp(prefix="divespot-"))
        weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        self._lock = Lock()
        self._waiting: defaultdict[At, list[bytes]] = defaultdict(list)
        self._bytes = 0
        self._written: set[At] = set()

    @property
    def voxel_m(self) -> float:
        """Edge of the voxels."""
        return self._nothing.voxel_m

    def put(self, pieces: Iterable[tuple[At, bytes]]) -> None:
        """Add what `Accumulator.blocks` gave, from any thread.

        Raises
        ------
        DivespotError
            The disk is full.

        """
        with self._lock:
            for at, data in pieces:
                self._waiting[at].append(data)
                self._bytes += len(data)
            if self._bytes > WAITING:
                self._write()

    def _write(self) -> None:
        try:
            for at, pieces in self._waiting.items():
                with self._path(at).open("ab") as stream:
                    stream.writelines(_framed(pieces))
        except OSError as err:
            raise DivespotError(
                f"{self._folder}: the survey's voxels, about 30 bytes a point, cannot be kept "
                f"there ({err.strerror}): another place is needed, named by TMPDIR"
            ) from None
        self._written.update(self._waiting)
        self._waiting.clear()
        self._bytes = 0

    def _path(self, at: At) -> Path:
        return self._folder / "{}_{}_{}".format(*at)

    def places(self) -> list[At]:
        """Return the places of all blocks that hold something, in order."""
        with self._lock:
            return sorted(self._written.union(self._waiting))

    def corners_m(self, places: list[At]) -> NDArray[np.float64]:
        """Return the corners of blocks, shape ``(n, 8, 3)``."""
        corners = np.array(list(itertools.product((0, 1), repeat=3)))
        at = np.array(places, dtype=np.float64).reshape(-1, 1, 3) + corners
        return np.asarray(self._origin_m + at * (EDGE * self.voxel_m))

    def load(self, places: Iterable[At]) -> Accumulator:
        """Return what some blocks hold: in larger voxels where it is more than may be held."""
        with self._lock:
            self._write()
        voxels = self._nothing.empty()
        for at in places:
            for piece in self._pieces(at):
                voxels.merge(Accumulator.from_bytes(piece))
        return voxels

    def _pieces(self, at: At) -> Iterator[bytes]:
        with self._path(at).open("rb") as stream:
            while head := stream.read(_LENGTH):
                yield stream.read(int.from_bytes(head, "little"))


def _framed(pieces: Iterable[bytes]) -> Iterator[bytes]:
    for piece in pieces:
        yield len(piece).to_bytes(_LENGTH, "little")
        yield piece
