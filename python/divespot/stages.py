"""Parameters of the method's stages, which are fixed for the measuring instrument."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from divespot._options import Checked, choice, count, described, flag, length, positive


@described
@dataclass(frozen=True, kw_only=True)
class Stages(Checked):
    """Parameters of the stages of the method (paper, Algorithms 1 to 4).

    They are fixed for the instrument; `Settings.paper` takes them by name, as in
    ``Settings.paper(window=3)``, and so does the command line with ``--preset paper``. Values that
    are None are derived from the scan.
    """

    min_neighbors: int = count(
        "neighbours that a point or cell needs within the radius of a filter", 5, 0
    )
    scene_cluster: bool = flag("keep only the largest cluster of all points")
    voxel_m: float | None = length(
        "edge of the voxels whose points are replaced by their mean, in metres; 0: none",
        *(0.0,),
        derivable=True,
    )
    surface: Literal["auto", "cells", "triangles"] = choice(
        "source of a cell's mean height: the points in it, or the triangles between points; "
        "auto: triangles where points are few or farther apart than cells are wide",
        "auto",
        "cells",
        "triangles",
    )
    plane_threshold_m: float | None = positive(
        "distance within which a point supports a plane, in metres"
    )
    hypotheses: int = count("most planes through three random points that RANSAC tries", 1000, 1)
    bin_m: float | None = positive("height of a bin of the height histogram, in metres")
    window: int = count("bins of the histogram's moving average, an odd number", 5, 1)
    lower_fraction: float = positive(
        "share of the height range, from below, in which the ground's peak is searched", 0.5, 1.0
    )
    ground_form: Literal["surface", "level"] = choice(
        "the ground that objects stand on: a smooth surface through it, or one level, the "
        "histogram's peak",
        "surface",
        "level",
    )
    fine_cluster: bool = flag(
        "cluster the cells above the ground; off: they are one object, split along valleys only",
        default=True,
    )
    fine_radius_m: float | None = length(
        "radius of the filter of the cells above the ground, in metres; 0: no filter"
    )
    cluster_backend: Literal["divespot", "hdbscan"] = choice(
        "HDBSCAN implementation: divespot's own, or the package hdbscan", "divespot", "hdbscan"
    )
    min_cluster_size: int = count("cells or points that make a cluster", 20, 2)
    min_samples: int = count(
        "HDBSCAN's min_samples: the neighbour whose distance is a point's core distance", 5, 1
    )
    link_m: float | None = positive("gap above which cells are two objects, in metres")
    select: Literal["all", "largest"] = choice("objects that are measured", "all", "largest")
    toe_m: float | None = length(
        "width of the strip around an object that may hold its toe, in metres"
    )
    annulus_share: float = positive(
        "width of the annulus of ground around a pile that supports its base, as a share of "
        "the square root of the pile's area",
        *(0.15, 10.0),
    )
    factor: float = positive(
        "compensation factor, by which every volume is multiplied as in the paper", 1.0
    )
