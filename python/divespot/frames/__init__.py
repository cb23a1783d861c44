"""From depth frames to a scan: `fuse` registers the frames and adds them up.

Layers: `intrinsics`, `poses` and `source` read input; `fusing` runs the kernels.
"""

from divespot.frames.fusing import fuse
from divespot.frames.intrinsics import Intrinsics, read_intrinsics
from divespot.frames.poses import read_poses, write_poses

__all__ = ["Intrinsics", "fuse", "read_intrinsics", "read_poses", "write_poses"]
