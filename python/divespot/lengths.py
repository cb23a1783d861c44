"""How lengths that were not given are derived from the scan."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.materials import MATERIALS
from divespot.plane import fit_plane
from divespot.settings import given

if TYPE_CHECKING:
    from divespot._typed import PaperChanges
    from divespot.settings import Settings
    from divespot.spacing import Survey

#: Flattest angle at which bulk material lies, in degrees: a toe that is margin high is at most
#: margin / tan(angle) wide.
FLATTEST_REPOSE_DEG = 15.0

#: A pile on this share of the scene should have 200 points, or 60 on a regular raster, where all
#: cells hold equally many: fifty cells of four points each. With fewer points, gaps, the toe and
#: walls have too much influence on the means over cells, and the surface is triangulated instead,
#: which takes several times as long.
PILE_SHARE, PILE_POINTS, REGULAR_POINTS = 0.01, 200, 60

#: A point within this many standard deviations of a plane supports it.
SIGMAS = 4.0

#: Edge of a cell, in point spacings: of cells that hold points, and of those of a triangulated
#: surface.
CELL, FINE = 2.0, 1.0 / 3.0

#: Number of thresholds tried for the flattest plane, each half of the previous one.
HALVINGS = 8

#: The ground holds at least this share of the points. In a normal distribution, this share lies
#: within 0.385 standard deviations of the mean.
FLAT_SHARE = 0.3
FLAT_QUANTILE = 0.385

#: Least threshold, for clouds without noise, as a share of the one derived from the spacing.
SMALLEST = 1e-3


def by_survey(settings: Settings, survey: Survey) -> Settings:
    """Return settings with the lengths derived from a cloud.

    A length is a multiple of the point spacing, or of the roughness if the sensor's noise is the
    coarser of the two.
    """
    spacing = _spacing(survey)
    enough = (REGULAR_POINTS if survey.regular else PILE_POINTS) / PILE_SHARE
    few = survey.positions < enough and settings.stages.surface != "cells"
    cell = spacing * (FINE if few else CELL) if settings.cell_m is None else settings.cell_m
    fitting: Any = "triangles" if cell < spacing else "cells"
    asked = settings.stages.surface
    chosen = settings.tuned(surface=fitting if asked == "auto" else asked)
    derived: PaperChanges = {
        "radius_m": 4.0 * spacing,
        "voxel_m": 2.0 * spacing,
        "cell_m": cell,
        "fine_radius_m": 2.5 * cell,
        "link_m": 2.5 * cell,
    }
    derived |= _density(settings)
    if chosen.stages.surface != "triangles":
        derived |= ground_lengths(survey)
    return chosen.completed(**derived)


def by_flatness(settings: Settings, flatness_m: float) -> Settings:
    """Return settings with the lengths derived from the ground's standard deviation.

    Used where points are as far apart as piles are high: the point spacing is then too coarse.
    """
    return settings.completed(plane_threshold_m=SIGMAS * flatness_m, bin_m=flatness_m)


def by_noise(settings: Settings, noise_m: float) -> Settings:
    """Return resolved settings with the lengths derived from the noise of the ground."""
    cell = given(settings.cell_m)
    margin = max(4.0 * noise_m, 0.5 * cell) if settings.margin_m is None else settings.margin_m
    return settings.completed(
        margin_m=margin,
        toe_m=margin / math.tan(math.radians(FLATTEST_REPOSE_DEG)) + cell,
    )


def _density(settings: Settings) -> PaperChanges:
    """Return the density of the material, unless a density is given."""
    material = MATERIALS.get(settings.material or "")
    if material is None or settings.density_kg_m3 is not None:
        return {"density_u_kg_m3": 0.0}
    return {
        "density_kg_m3": material.density_kg_m3,
        "density_u_kg_m3": material.density_u_kg_m3,
    }


def ground_lengths(survey: Survey) -> PaperChanges:
    """Return the plane's threshold and the histogram's bin, by point spacing and roughness."""
    spacing = _spacing(survey)
    roughness = _rounded(survey.roughness_m)
    return {
        "plane_threshold_m": max(1.5 * spacing, SIGMAS * roughness),
        "bin_m": max(roughness, spacing / 8.0),
    }


def _spacing(survey: Survey) -> float:
    """Return the spacing for deriving lengths; that of a raster is exact and not rounded."""
    return survey.spacing_m if survey.regular else _rounded(survey.spacing_m)


def _rounded(length_m: float) -> float:
    """Return the nearest of sixteen lengths per factor of two.

    So random variation does not change the cell: a shifted or turned scan keeps its cells.
    """
    return 2.0 ** (round(16.0 * math.log2(length_m)) / 16.0) if length_m > 0.0 else 0.0


def flatness(found: Survey, settings: Settings) -> float:
    """Return the standard deviation of the flattest part of a cloud about its plane, in metres.

    Where points are as far apart as piles are high, neighbours do not show how thick the ground
    is, and a threshold derived from their spacing includes the piles. Planes are fitted within ever
    smaller thresholds; the one is taken to which the nearest share `FLAT_SHARE` of the surveyed
    points is nearest (least quantile of squares).
    """
    widest_m = given(ground_lengths(found)["plane_threshold_m"])
    least = widest_m * FLAT_QUANTILE / SIGMAS
    for halvings in range(HALVINGS):
        threshold_m = widest_m / 2.0**halvings
        plane = fit_plane(found.at_m, threshold_m, seed=settings.seed, threads=settings.threads)
        off = np.abs(plane.heights_m(found.at_m))
        least = min(least, float(np.quantile(off, FLAT_SHARE)))
    return max(least / FLAT_QUANTILE, SMALLEST * widest_m)
