"""What can be set, what it means, and how what is not set follows from the scan."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from divespot._arguments import MOST_THREADS
from divespot._options import base, box, choice, count, flag, length, listed, path, positive, text
from divespot.errors import DivespotError
from divespot.materials import MATERIALS

if TYPE_CHECKING:
    from divespot.spacing import Survey

#: No bulk material lies flatter than this; a toe is no wider than the margin's height makes it.
FLATTEST_REPOSE_DEG = 15.0

#: A pile that takes up this share of the scene is to have so many points at least, fewer where all
#: cells hold equally many: over the means of fifty cells of about four points, gaps, its toe and a
#: wall beside it still weigh. With fewer points in all than gives it these, the surface is
#: triangulated, which takes several times as long.
PILE_SHARE, PILE_POINTS, REGULAR_POINTS = 0.01, 200, 60

#: A point this many standard deviations from a plane does not support it.
SIGMAS = 4.0

#: Edge of the cells on which the triangles between few points are drawn, in point spacings.
FINE = 1.0 / 3.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """The settings of `divespot.measure`; the command line has an option for each.

    What is None follows from the cloud's own point spacing. `Settings()` is the measuring
    instrument; `Settings.paper()` is the paper's method to the letter.
    """

    unit: str = text("unit of the file's coordinates; auto: as the file says, else m", "auto")
    crs: str | None = text(
        "reference system of the scan where its file states none: EPSG:CODE or WKT (extra crs)",
        None,
        metavar="SYSTEM",
    )
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
        "keep this box only: x0,y0,z0,x1,y1,z1 in the scan's frame and unit", "xyz"
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
        "measure inside the polygons of this file (GeoJSON, GeoPackage, Shapefile, KML, DXF), in "
        "the scan's frame and unit or another reference system, instead of finding piles"
    )
    inside: tuple[float, ...] | None = box(
        "measure inside this rectangle, x0,y0,x1,y1 in the scan's frame and unit, instead of "
        "finding piles",
        "xy",
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
        if self.outline is not None and self.inside is not None:
            raise DivespotError("outline and inside were both given: one of them is needed")

    @property
    def is_outlined(self) -> bool:
        """Whether piles are not found but given, by an outline or a rectangle."""
        return self.outline is not None or self.inside is not None

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

    def resolved(self, survey: Survey, points: int) -> Settings:
        """Return these settings with the lengths that follow from the cloud of so many points.

        A length is a multiple of the point spacing; of the roughness, where the sensor's noise
        is the coarser of the two.
        """
        spacing = _spacing(survey)
        enough = (REGULAR_POINTS if survey.regular else PILE_POINTS) / PILE_SHARE
        few = points < enough and self.surface != "cells"
        cell = spacing * (FINE if few else 2.0) if self.cell_m is None else self.cell_m
        fitting: Any = "triangles" if cell < spacing else "cells"
        chosen = self.changed(surface=fitting if self.surface == "auto" else self.surface)
        return chosen.completed(
            radius_m=4.0 * spacing,
            voxel_m=2.0 * spacing,
            cell_m=cell,
            fine_radius_m=2.5 * cell,
            link_m=2.5 * cell,
            inner_voxel_m=cell,
            slice_m=0.25 * cell,
            **({} if chosen.surface == "triangles" else ground_lengths(survey)),
            **self._density(),
        )

    def flattened(self, flatness_m: float) -> Settings:
        """Return settings with the lengths that follow from the ground's standard deviation.

        Where points are as far apart as piles are high, their spacing does not tell it.
        """
        return self.completed(plane_threshold_m=SIGMAS * flatness_m, bin_m=flatness_m)

    def grounded(self, noise_m: float) -> Settings:
        """Return resolved settings with the lengths that follow from the noise of the ground."""
        cell = given(self.cell_m)
        margin = max(4.0 * noise_m, 0.5 * cell) if self.margin_m is None else self.margin_m
        return self.completed(
            margin_m=margin,
            toe_m=margin / math.tan(math.radians(FLATTEST_REPOSE_DEG)) + cell,
        )

    def _density(self) -> dict[str, float]:
        """Return what follows from the material, unless a density is given."""
        material = MATERIALS.get(self.material or "")
        if material is None or self.density_kg_m3 is not None:
            return {"density_u_kg_m3": 0.0}
        return {
            "density_kg_m3": material.density_kg_m3,
            "density_u_kg_m3": material.density_u_kg_m3,
        }

    def completed(self, **derived: Any) -> Settings:  # noqa: ANN401 - as many types as settings
        """Return these settings with values for those that are not known yet."""
        open_ = (None, "auto")
        missing = {name: value for name, value in derived.items() if getattr(self, name) in open_}
        return self.changed(**missing)


def ground_lengths(survey: Survey) -> dict[str, float]:
    """Return how thick a plane and how high a histogram's bin is, by spacing and roughness."""
    spacing = _spacing(survey)
    roughness = _rounded(survey.roughness_m)
    return {
        "plane_threshold_m": max(1.5 * spacing, SIGMAS * roughness),
        "bin_m": max(roughness, spacing / 8.0),
    }


def _spacing(survey: Survey) -> float:
    """Return the spacing that lengths are multiples of; a raster has exactly its own."""
    return survey.spacing_m if survey.regular else _rounded(survey.spacing_m)


def _rounded(length_m: float) -> float:
    """Return the nearest of sixteen lengths in a factor of two.

    So chance does not reach the size of a cell: a scan that is moved or turned keeps its cells.
    """
    return 2.0 ** (round(16.0 * math.log2(length_m)) / 16.0) if length_m > 0.0 else 0.0


#: Bases that stand whether or not the ground is in view.
GIVEN = ("height=", "surface=")


def needs_ground(settings: Settings) -> bool:
    """Return whether piles stand on the ground in view, not on a floor that was given."""
    return not settings.is_outlined and not settings.base.startswith(GIVEN)


def given(value: float | None) -> float:
    """Return a length that must be known by now."""
    if value is None:
        raise DivespotError("a length is not known yet: settings must be resolved against a scan")
    return value
