"""The volume of each pile in a point cloud, with its uncertainty."""

from divespot._native import __version__
from divespot.errors import DivespotError
from divespot.kernels import radius_outlier_mask, voxel_downsample

__all__ = ["DivespotError", "__version__", "radius_outlier_mask", "voxel_downsample"]
