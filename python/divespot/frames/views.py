"""What frames look like to the steps that put them together, whatever they come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot import _native
    from divespot.frames.source import Frames

Pose: TypeAlias = "list[list[float]]"
Frame: TypeAlias = "tuple[_native.RawCamera, NDArray[np.float32]]"


class Views(Protocol):
    """Frames as ranges along rays."""

    @property
    def source(self) -> Frames:
        """The frames as they came."""

    @property
    def threads(self) -> int:
        """Threads to use; 0: all."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """What there is to say of how they were taken."""

    def __len__(self) -> int:
        """Return how many there are."""

    def frame(self, number: int) -> Frame:
        """Return a frame: what took it, and its ranges."""

    def fusion(
        self, joint: _native.RawJoint, voxel_m: float | None, wide: float
    ) -> _native.RawFusion:
        """Return voxels to add frames to, by default so many pixels wide."""
