"""The volume of each pile in a point cloud, with its uncertainty."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from divespot._native import __version__
from divespot.budget import Budget
from divespot.clustering import Clusters, hdbscan
from divespot.doors import Report
from divespot.errors import DivespotError
from divespot.grid import HeightMap, Volume, height_map, integrate
from divespot.info import Info, info
from divespot.intake import Source
from divespot.kernels import (
    HeightHistogram,
    ground_height,
    height_histogram,
    radius_outlier_mask,
    voxel_downsample,
)
from divespot.materials import MATERIALS, Material
from divespot.pipeline import measure
from divespot.plane import Plane, fit_plane, rotation_to_z
from divespot.report import Ground, Pile, Total
from divespot.results.outlines import save_outlines
from divespot.save import save_base
from divespot.settings import Settings
from divespot.spacing import Survey, point_spacing, survey
from divespot.stages import Stages

if TYPE_CHECKING:
    from divespot.comparing import compare
    from divespot.doors import Comparison

#: What is imported when it is first asked for.
_LATER = {
    "Comparison": "divespot.doors",
    "compare": "divespot.comparing",
}

__all__ = [
    "MATERIALS",
    "Budget",
    "Clusters",
    "Comparison",
    "DivespotError",
    "Ground",
    "HeightHistogram",
    "HeightMap",
    "Info",
    "Material",
    "Pile",
    "Plane",
    "Report",
    "Settings",
    "Source",
    "Stages",
    "Survey",
    "Total",
    "Volume",
    "__version__",
    "compare",
    "fit_plane",
    "ground_height",
    "hdbscan",
    "height_histogram",
    "height_map",
    "info",
    "integrate",
    "measure",
    "point_spacing",
    "radius_outlier_mask",
    "rotation_to_z",
    "save_base",
    "save_outlines",
    "survey",
    "voxel_downsample",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has that name
    if name in _LATER:
        return getattr(import_module(_LATER[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
