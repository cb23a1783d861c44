"""From depth frames to a scan: `fuse` finds where each frame stood, and puts them together.

Layers: `intrinsics`, `poses` and `source` read what a user has; `fusing` runs the kernels.
"""

from divespot.frames.fusing import fuse
from divespot.frames.intrinsics import Intrinsics, read_intrinsics
from divespot.frames.poses import read_poses, write_poses

__all__ = ["Intrinsics", "fuse", "read_intrinsics", "read_poses", "write_poses"]
