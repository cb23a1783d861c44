"""Volumes of one pile by the methods that the paper compares.

Each method takes points of shape ``(n, 3)``: x, y and the height above the base, one point per
cell. `bodies_of` makes such points from the result of `divespot.measure`; `volumes_m3` measures all
piles of a report by any method. All but the voxels need SciPy: ``pip install divespot[methods]``.
"""

from divespot.volume.alpha import alpha_shape
from divespot.volume.body import Body, bodies_of
from divespot.volume.hull import hull
from divespot.volume.methods import METHODS, volumes_m3
from divespot.volume.slices import slices
from divespot.volume.tin import tin
from divespot.volume.voxels import inner_voxels

__all__ = [
    "METHODS",
    "Body",
    "alpha_shape",
    "bodies_of",
    "hull",
    "inner_voxels",
    "slices",
    "tin",
    "volumes_m3",
]
