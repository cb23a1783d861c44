"""The 18 pile shapes of the paper's evaluation section, as scenes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot.simulate.floor import Floor
from divespot.simulate.pose import Pose
from divespot.simulate.scene import Camera, Pile, Scene
from divespot.simulate.surroundings import around

if TYPE_CHECKING:
    from divespot.simulate.things import XY

Maker: TypeAlias = Callable[[np.random.Generator], Scene]

STRIPS_M: Mapping[float, XY] = MappingProxyType(
    {1.3: (1.24, 1.05), 2.6: (2.48, 1.05), 5.2: (2.48, 2.1)}
)
"""Length and width of the strip of each of the paper's areas in m2."""
RAIL_CAMERAS: Mapping[float, Camera] = MappingProxyType(
    {
        1.3: Camera(frames=4, rail_m=0.6),
        2.6: Camera(frames=6, rail_m=1.9),
        5.2: Camera(frames=6, rail_m=1.9),
    }
)
"""Camera for each area: more rail and frames for a longer strip."""
VOXELS_M: Mapping[float, float] = MappingProxyType({1.3: 0.0055, 2.6: 0.0068, 5.2: 0.0066})
"""Fusing voxel for each area, for 300,000 to 450,000 points in view."""
TABLE = ((1.3, (0.014, 0.028, 0.035)), (2.6, (0.028, 0.035)), (5.2, (0.335,)))
"""Areas in m2 and volumes in m3 of the paper; three shapes each."""
ROWS = MappingProxyType(
    {
        f"shape-{i:02d}": row
        for i, row in enumerate(
            (
                (area, volume, kind)
                for area, volumes in TABLE
                for volume in volumes
                for kind in range(3)
            ),
            start=1,
        )
    }
)
"""Area in m2, volume in m3 and kind (see `corn`) of each row of the paper's table, by name."""


def unlevelled(rng: np.random.Generator) -> Pose:
    """Draw a pose: rails are not level to a degree, and the origin is not on the floor."""
    roll_deg, pitch_deg = rng.uniform(-4, 4, 2)
    x, y, z = rng.uniform(-1, 1, 3)
    return Pose(roll_deg, pitch_deg, rng.uniform(0, 360), (x, y, z))


def optical_pose(camera: Camera) -> Pose:
    """Turn the scene into the optical frame of a camera in the middle of its rail."""
    roll_deg = -(180 + camera.pitch_deg)
    lens_m = np.array([0.0, camera.offset_m, camera.height_m])
    shift_m = -(Pose(roll_deg).matrix()[:3, :3] @ lens_m)
    return Pose(roll_deg, shift_m=(float(shift_m[0]), float(shift_m[1]), float(shift_m[2])))


def corn(volume_m3: float, kind: int, rng: np.random.Generator, center_m: XY = (0, 0)) -> Pile:
    """Corn poured in one place (kind 0), along a line (1) or in several places (2)."""
    heading_deg = rng.uniform(-15, 15)
    if kind == 0:
        return Pile(volume_m3, center_m)
    if kind == 1:
        return Pile(volume_m3, center_m, ridge=rng.uniform(0.3, 0.5), heading_deg=heading_deg)
    peaks = int(rng.integers(3, 5))
    return Pile(volume_m3, center_m, peaks=peaks, spread=0.4, heading_deg=heading_deg)


def small_floor(strip_m: XY) -> Floor:
    """Floor that extends beyond the camera's view from above a strip."""
    return Floor(strip_m[0] + 1.6, max(2.4, strip_m[1] + 0.8))


def shape(area_m2: float, volume_m3: float, kind: int, rng: np.random.Generator) -> Scene:
    """One of the paper's shapes."""
    strip_m, camera = STRIPS_M[area_m2], RAIL_CAMERAS[area_m2]
    return Scene(
        small_floor(strip_m),
        (corn(volume_m3, kind, rng),),
        around(strip_m, camera.frames, rng),
        camera,
        unlevelled(rng),
        fuse_voxel_m=VOXELS_M[area_m2],
        strip_m=strip_m,
    )


def shape_maker(area_m2: float, volume_m3: float, kind: int) -> Maker:
    """Return a maker of the shape in a row of the paper's table."""
    return lambda rng: shape(area_m2, volume_m3, kind, rng)


def paper_shapes() -> dict[str, Maker]:
    """Return the makers of all rows of the paper's table."""
    return {name: shape_maker(*row) for name, row in ROWS.items()}
