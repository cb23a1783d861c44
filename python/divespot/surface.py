"""The one surface: what the ground and the material on it show to the sky."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from divespot import _native
from divespot.grid import HeightMap, height_map
from divespot.settings import given

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.settings import Settings
    from divespot.spacing import Survey

#: Bases that stand whether or not the ground is in view.
GIVEN = ("height=", "surface=")

#: The walk goes over cells of so many point spacings, that each holds some points.
WALKED = 2.0


@dataclass(frozen=True)
class Surface:
    """Levelled points, shape ``(n, 3)``, and which of them lie on the surface, shape ``(n,)``."""

    points: NDArray[np.float64]
    is_on: NDArray[np.bool_]


def find_surface(points: NDArray[np.float64], scan: Survey, settings: Settings) -> Surface:
    """Walk the surface from the ground; what cannot be reached so stands, hangs or flies.

    With a floor or an outline that was given, the ground need not be in view.
    The paper takes every point for the surface.
    """
    if settings.ground_form == "level":
        return Surface(points, np.ones(len(points), dtype=np.bool_))
    few = settings.surface == "triangles"
    cell_m = WALKED * scan.spacing_m if few else given(settings.cell_m)
    anywhere = settings.outline is not None or settings.base.startswith(GIVEN)
    is_on = _native.surface_points(points, cell_m, scan.roughness_m, anywhere, settings.threads)
    return Surface(points, is_on)


def map_heights(surface: Surface, settings: Settings) -> HeightMap:
    """Average the surface's points over the cells of a grid that lies over all of them."""
    return height_map(
        surface.points,
        given(settings.cell_m),
        triangulated=settings.surface == "triangles",
        mask=surface.is_on,
    )
