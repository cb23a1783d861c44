"""Frames as all later steps see them, whatever their source."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from divespot import _native

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from divespot.frames.source import Frames

Pose: TypeAlias = "list[list[float]]"
Frame: TypeAlias = "tuple[_native.RawCamera, NDArray[np.float32]]"


@dataclass(frozen=True, eq=False, kw_only=True)
class Views(ABC):
    """Frames as ranges along rays.

    Attributes
    ----------
    source
        The frames as they were read.
    pitch
        Largest angle between neighbouring rays.
    threads
        Number of threads; 0: all.
    doubts
        Warnings about how the frames were taken.

    """

    source: Frames
    pitch: float
    threads: int
    doubts: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.source)

    @abstractmethod
    def frame(self, number: int) -> Frame:
        """Return a frame: its camera and its ranges."""

    def fusion(
        self, joint: _native.RawJoint, voxel_m: float | None, wide: float
    ) -> _native.RawFusion:
        """Return empty voxels to add frames to, by default `VOXEL` pixels wide."""
        if voxel_m is None:
            voxel_m = wide * joint.range_m * self.pitch
        return _native.RawFusion(voxel_m, joint.noise, joint.range_m, self.threads)
