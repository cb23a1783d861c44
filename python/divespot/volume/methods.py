"""The methods by name, and the objects of a scan measured by one of them."""

from __future__ import annotations

import dataclasses
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.settings import given
from divespot.volume.alpha import alpha_shape
from divespot.volume.body import body
from divespot.volume.hull import hull
from divespot.volume.slices import slices
from divespot.volume.tin import tin
from divespot.volume.voxels import inner_voxels

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from divespot import _native
    from divespot.grid import HeightMap
    from divespot.objects import Measured
    from divespot.settings import Settings
    from divespot.volume.body import Body

#: Radius, in cells, of the disc that rolls around a concave contour.
REACH_CELLS = 2.0


def _sliced(body: Body, s: Settings) -> float:
    reach_m = REACH_CELLS * body.cell_m
    return slices(body.points_m, given(s.slice_m), contour=s.slice_contour, reach_m=reach_m)


METHODS: Mapping[str, Callable[[Body, Settings], float]] = MappingProxyType(
    {
        "voxels": lambda body, s: inner_voxels(body.points_m, given(s.inner_voxel_m)),
        "slices": _sliced,
        "hull": lambda body, _: hull(body.points_m),
        "alpha": lambda body, s: alpha_shape(body.points_m, given(s.alpha_m)),
        "tin": lambda body, _: tin(body.points_m, body.outline_m),
    }
)
"""Volume of a body by each method other than the ground grid."""


def by_method(
    grid: HeightMap, measured: Measured, settings: Settings, warn: Callable[[str], None]
) -> tuple[Measured, Settings]:
    """Measure the volumes again by the method that was asked for, above the same base.

    Returns
    -------
    measured
        The objects with their volumes by the method; as they were for ``grid``.
    settings
        With the radius of the alpha shape: the height of the highest pile, unless given.

    """
    # No empty sphere inside a pile is larger than half of its height; twice that is on the safe
    # side of noise.
    piles = [item for item in measured.objects if item.reason is None] or measured.objects
    highest = max([grid.cell_m, *(item.max_height_m for item in piles)])
    settings = settings.completed(alpha_m=highest)
    if settings.method == "grid" or not measured.objects:
        return measured, settings
    warn(
        f"volumes are by the method {settings.method}; u95_m3 is the ground grid's, without the "
        "method's own error"
    )
    objects = [_remeasured(item, grid, measured, settings) for item in measured.objects]
    return dataclasses.replace(measured, objects=objects), settings


def _remeasured(
    item: _native.RawObject, grid: HeightMap, measured: Measured, settings: Settings
) -> _native.RawObject:
    found = body(grid, measured.base_m, item.outline_m)
    volume = METHODS[settings.method](found, settings)
    return item.with_volume(max(volume, 0.0), max(-volume, 0.0))
