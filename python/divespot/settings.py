"""What can be set, what it means, and how what is not set follows from the scan."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, Literal

from divespot._arguments import MOST_THREADS
from divespot._options import base, box, choice, count, flag, length, listed, path, positive, text
from divespot.errors import DivespotError
from divespot.materials import MATERIALS


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The settings of `divespot.measure`; the command line has an option for each.

    What is None follows from the cloud's own point spacing. `Settings()` is the measuring
    instrument; `Settings.paper()` is the paper's method to the letter.
    """

    unit: str = text("unit of the file's coordinates; auto: as the file says, else m", "auto")
    columns: str | None = listed(
        "where x, y, z stand in a text table: numbers from 1 or names, as 3,2,4",
        *("three numbers or names, as 3,2,4,", r"[^,]+,[^,]+,[^,]+"),
    )
    classes: str | None = listed(
        "classes of a LAS file to keep, as 2,6; without: all but noise",
        *("numbers from 0 to 255, as 2,6,", r" *\d{1,3} *(, *\d{1,3} *)*"),
    )
    returns: Literal["all", "first", "last"] = choice(
        "returns of a LAS file to keep", "all", "first", "last"
    )
    crop: tuple[float, ...] | None = box(
        "keep this box only: x0,y0,z0,x1,y1,z1 in the scan's frame and unit"
    )
    up: str = text("where up is, roughly: auto, x, y, z, -x, -y, -z or a,b,c", "auto")
    max_tilt_deg: float = positive(
        "largest angle between a given up and the ground's normal", 45.0, most=90.0
    )
    radius_m: float | None = length("radius of the filter of stray points; 0: no filter")
    min_neighbors: int = count("neighbours that a point needs within the radius", 5, 0)
    scene_cluster: bool = flag("keep only the largest cluster of the whole scene (paper)")
    voxel_m: float | None = length(
        "edge of the voxels for uniform sampling; 0: none", 0.0, derivable=True
    )
    level: bool = flag("turn the ground level; off: z is up, as it is in the scan", default=True)
    plane_threshold_m: float | None = positive("distance within which points support a plane")
    hypotheses: int = count("planes through three random points that are tried at most", 1000, 1)
    cell_m: float | None = positive("edge of a cell of the ground grid")
    surface: Literal["auto", "cells", "triangles"] = choice(
        "what the grid's heights are means of: the points in each cell, or the triangles between "
        "them; auto: triangles where points are few or cells narrower than their spacing",
        "auto",
        "cells",
        "triangles",
    )
    bin_m: float | None = positive("height of a bin of the height histogram")
    window: int = count("bins of the histogram's moving average, an odd number", 5, 1)
    lower_fraction: float = positive(
        "part of the height range in which the ground lies", 0.5, most=1.0
    )
    ground_form: Literal["surface", "level"] = choice(
        "what objects stand out of: the ground as a gentle surface, or the histogram's peak",
        "surface",
        "level",
    )
    margin_m: float | None = positive("height above the ground from which it is an object")
    fine_cluster: bool = flag(
        "cluster what stands above the ground; off: it is one, but where valleys part it",
        default=True,
    )
    fine_radius_m: float | None = length("radius of the filter above ground; 0: no filter")
    cluster_backend: Literal["divespot", "hdbscan"] = choice(
        "what does the clustering", "divespot", "hdbscan"
    )
    min_cluster_size: int = count("cells or points that make a cluster", 20, 2)
    min_samples: int = count("neighbours that make a cell or point a cluster's core", 5, 1)
    link_m: float | None = positive("gap above which objects are apart")
    select: Literal["all", "largest"] = choice("objects that are measured", "all", "largest")
    outline: str | None = path(
        "measure inside the polygons of this GeoJSON file, in the scan's frame and unit, instead "
        "of finding piles"
    )
    base: str = base(
        "what a pile stands on: local (the ground around it), plane (the ground's), peak or "
        "midpeak (of the height histogram; paper), height=H (along up in the scan's frame and "
        "unit), camera-height=H (of the scan's origin above the ground; paper), surface=FILE (an "
        "earlier scan of the empty floor, or a saved base)"
    )
    compare_bases: bool = flag("show each pile's volume above every base that needs no input")
    toe_m: float | None = length("width around an object that may hold its toe")
    ring_share: float = positive(
        "width of the ring of ground for the local base, by object size", 0.15
    )
    method: Literal["grid", "voxels", "slices", "hull", "alpha", "tin"] = choice(
        "how a volume is taken: ground grid (paper), inner voxels, slices, convex hull, alpha "
        "shape, triangles (see `divespot.volume`; all but the first two need SciPy)",
        *("grid", "voxels", "slices", "hull", "alpha", "tin"),
    )
    inner_voxel_m: float | None = positive("edge of the voxels of the method voxels")
    slice_m: float | None = positive("thickness of the layers of the method slices")
    slice_contour: Literal["convex", "concave"] = choice(
        "hull around the points of a layer", "convex", "concave"
    )
    alpha_m: float | None = positive("largest radius of the method alpha")
    factor: float = positive("compensation factor of the volume (paper)", 1.0)
    density_kg_m3: float | None = positive("bulk density, for the mass")
    density_u_kg_m3: float | None = length(
        "standard uncertainty of the density; without one, that of the material's, or 0"
    )
    material: str | None = choice(
        "take the density of this material, where none is given (see `divespot materials`)",
        *MATERIALS,
        default=None,
    )
    seed: int = count("seed of all random draws", 0, 0, most=2**64 - 1)
    threads: int = count("threads; 0: all that this process may use", 0, 0, most=MOST_THREADS)

    def __post_init__(self) -> None:
        """Check every value, and take plain Python numbers for those of NumPy."""
        for item in dataclasses.fields(self):
            plain = item.metadata["plain"](item.name, getattr(self, item.name))
            object.__setattr__(self, item.name, plain)

    @classmethod
    def paper(cls, **changes: Any) -> Settings:  # noqa: ANN401 - as many types as settings
        """Return the paper's method: one pile, cut above one ground height, without a toe."""
        paper: dict[str, Any] = {
            "scene_cluster": True,
            "voxel_m": None,
            "ground_form": "level",
            "select": "largest",
            "surface": "cells",
            "base": "peak",
            "toe_m": 0.0,
        }
        return cls().changed(**{**paper, **changes})

    def changed(self, **changes: Any) -> Settings:  # noqa: ANN401 - as many types as settings
        """Return these settings with some of them changed.

        Raises
        ------
        DivespotError
            A name is no setting, or a value out of range.

        """
        known = [item.name for item in dataclasses.fields(self)]
        for name in changes:
            if name not in known:
                raise DivespotError(
                    f"unknown setting {name!r}: one of {', '.join(known)} is needed"
                )
        return dataclasses.replace(self, **changes)

    def completed(self, **derived: Any) -> Settings:  # noqa: ANN401 - as many types as settings
        """Return these settings with values for those that are not known yet."""
        open_ = (None, "auto")
        missing = {name: value for name, value in derived.items() if getattr(self, name) in open_}
        return self.changed(**missing)


#: Bases that stand whether or not the ground is in view.
GIVEN = ("height=", "surface=")


def needs_ground(settings: Settings) -> bool:
    """Return whether piles stand on the ground in view, not on a floor that was given."""
    return settings.outline is None and not settings.base.startswith(GIVEN)


def given(value: float | None) -> float:
    """Return a length that must be known by now."""
    if value is None:
        raise DivespotError("a length is not known yet: settings must be resolved against a scan")
    return value
