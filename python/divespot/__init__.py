"""The volume of each pile in a point cloud, with its uncertainty."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from divespot._native import __version__
from divespot.errors import DivespotError

if TYPE_CHECKING:
    from divespot.budget import Budget
    from divespot.clustering import Clusters, hdbscan
    from divespot.comparing import compare
    from divespot.doors import Comparison, Report
    from divespot.grid import HeightMap, Volume, height_map, integrate
    from divespot.intake import Source
    from divespot.kernels import (
        HeightHistogram,
        ground_height,
        height_histogram,
        radius_outlier_mask,
        voxel_downsample,
    )
    from divespot.materials import MATERIALS, Material
    from divespot.overview import Info, info
    from divespot.pipeline import measure
    from divespot.plane import Plane, fit_plane, rotation_to_z
    from divespot.report import Ground, Pile, Total
    from divespot.results.outlines import save_outlines
    from divespot.save import save_base
    from divespot.settings import Settings
    from divespot.spacing import Survey, point_spacing, survey
    from divespot.stages import Stages

#: Names imported on first access, so that a script starts quickly.
_LATER = {
    "Budget": "divespot.budget",
    "Clusters": "divespot.clustering",
    "Comparison": "divespot.doors",
    "Ground": "divespot.report",
    "HeightHistogram": "divespot.kernels",
    "HeightMap": "divespot.grid",
    "Info": "divespot.overview",
    "MATERIALS": "divespot.materials",
    "Material": "divespot.materials",
    "Pile": "divespot.report",
    "Plane": "divespot.plane",
    "Report": "divespot.doors",
    "Settings": "divespot.settings",
    "Source": "divespot.intake",
    "Stages": "divespot.stages",
    "Survey": "divespot.spacing",
    "Total": "divespot.report",
    "Volume": "divespot.grid",
    "compare": "divespot.comparing",
    "fit_plane": "divespot.plane",
    "ground_height": "divespot.kernels",
    "hdbscan": "divespot.clustering",
    "height_histogram": "divespot.kernels",
    "height_map": "divespot.grid",
    "info": "divespot.overview",
    "integrate": "divespot.grid",
    "measure": "divespot.pipeline",
    "point_spacing": "divespot.spacing",
    "radius_outlier_mask": "divespot.kernels",
    "rotation_to_z": "divespot.plane",
    "save_base": "divespot.save",
    "save_outlines": "divespot.results.outlines",
    "survey": "divespot.spacing",
    "voxel_downsample": "divespot.kernels",
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
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_LATER[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})
