"""The volume of each pile in a point cloud, with its uncertainty."""

from divespot._native import __version__
from divespot.clustering import Clusters, hdbscan
from divespot.errors import DivespotError
from divespot.kernels import (
    HeightHistogram,
    ground_height,
    height_histogram,
    point_spacing,
    radius_outlier_mask,
    voxel_downsample,
)

__all__ = [
    "Clusters",
    "DivespotError",
    "HeightHistogram",
    "__version__",
    "ground_height",
    "hdbscan",
    "height_histogram",
    "point_spacing",
    "radius_outlier_mask",
    "voxel_downsample",
]
