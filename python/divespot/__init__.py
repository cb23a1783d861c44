"""The volume of each pile in a point cloud, with its uncertainty."""

from divespot._native import __version__
from divespot.clustering import Clusters, hdbscan
from divespot.errors import DivespotError
from divespot.kernels import radius_outlier_mask, voxel_downsample

__all__ = [
    "Clusters",
    "DivespotError",
    "__version__",
    "hdbscan",
    "radius_outlier_mask",
    "voxel_downsample",
]
