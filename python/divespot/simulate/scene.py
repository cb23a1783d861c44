"""The parts of a scene: frozen records, checked when created.

Scene frame: metres, x along the camera's rail, y across it, z up, origin at the floor's centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from divespot.simulate.checks import (
    require,
    require_not_negative,
    require_positive,
    require_share,
)
from divespot.simulate.floor import Floor
from divespot.simulate.ghosts import Ghosts
from divespot.simulate.pose import Pose

if TYPE_CHECKING:
    from divespot.simulate.things import XY, Thing
    from divespot.simulate.vessel import Vessel


@dataclass(frozen=True)
class Cut:
    """A plane face that a loader left, steeper than the material would lie.

    Parameters
    ----------
    heading_deg
        Direction that it faces, from x.
    toe
        Distance of its toe from the middle of the pile, in radii of the cone of the same volume.
    face_deg
        Angle of the face.
    """

    heading_deg: float = 0.0
    toe: float = 0.5
    face_deg: float = 70.0

    def __post_init__(self) -> None:
        require(
            0 < self.face_deg < 88,
            f"Cut.face_deg is {self.face_deg}: an angle above 0 and below 88 is needed",
        )


@dataclass(frozen=True)
class Pile:
    """A heap of bulk material of exactly known volume.

    Poured at one or more points (cones) or along lines (ridges), at the material's angle of
    repose. Where piles touch, the higher surface counts, and each pile's truth is the volume on its
    own side of the valley.

    Parameters
    ----------
    volume_m3
        Volume above the floor of the pile standing alone, without walls it leans on.
    center_m
        Centre of its footprint on a level floor without walls.
    repose_deg
        Angle of repose: no flank is steeper, except for grain-scale roughness.
    peaks
        Number of peaks.
    spread
        Spread of the peaks, in radii of the cone of the same volume.
    ridge
        Half the length of the line along which each peak is poured, in the same radii.
    heading_deg
        Direction of the ridges and of the longer spread, from x; random if not given.
    roughness_m, grain_m
        Standard deviation and correlation length of the surface's roughness.
    skew_deg
        Largest angle between a ridge and the heading.
    cut
        The face that a loader cut.
    """

    volume_m3: float
    center_m: XY = (0.0, 0.0)
    repose_deg: float = 23.0
    peaks: int = 1
    spread: float = 0.6
    ridge: float = 0.0
    heading_deg: float | None = None
    roughness_m: float = 0.001
    grain_m: float = 0.008
    skew_deg: float = 15.0
    cut: Cut | None = None

    def __post_init__(self) -> None:
        require_positive(self, "volume_m3", "grain_m")
        require_not_negative(self, "roughness_m", "spread", "ridge")
        require(
            1 <= self.repose_deg <= 60,
            f"Pile.repose_deg is {self.repose_deg}: an angle from 1 to 60 is needed",
        )
        require(self.peaks >= 1, f"Pile.peaks is {self.peaks}: at least 1 is needed")


@dataclass(frozen=True)
class Camera:
    """A depth camera that takes frames along a straight rail above y = `offset_m`.

    The noise is along the ray: sigma(r) = min(noise_m (r / 1 m)^noise_power, noise_max_m). The
    defaults follow an Azure Kinect in narrow field of view: 1.6 mm at 1.4 m, up to 17 mm; the
    wider opening lies across the rail.

    Parameters
    ----------
    frames, rail_m
        Number of frames, and the length of rail they are spread over, middle at x = 0.
    height_m
        Height of the lens above z = 0.
    offset_m
        Position of the rail in y.
    pitch_deg
        Tilt of the optical axis from straight down towards +y.
    pixels, fov_deg
        Columns (along x) and rows (across), and the opening angles of both.
    range_m
        Nearest and farthest range that is measured.
    bias_m, frame_bias_m
        Depth error common to all frames, and standard deviation of each frame's own error.
    shift_m, turn_deg
        Standard deviation, per axis, of each frame's registration error.
    flying_share
        Share of the depth edges between two pixels with a flying pixel.
    stray_share, zero_share, nan_share
        Shares of the final points that are outliers, are (0, 0, 0), are NaN.
    """

    frames: int = 5
    rail_m: float = 0.8
    height_m: float = 1.414
    offset_m: float = 0.0
    pitch_deg: float = 0.0
    pixels: tuple[int, int] = (576, 640)
    fov_deg: tuple[float, float] = (65.0, 75.0)
    range_m: tuple[float, float] = (0.2, 3.9)
    noise_m: float = 0.0008
    noise_power: float = 2.0
    noise_max_m: float = 0.017
    bias_m: float = 0.004
    frame_bias_m: float = 0.001
    shift_m: float = 0.001
    turn_deg: float = 0.05
    flying_share: float = 0.6
    stray_share: float = 0.002
    zero_share: float = 0.0
    nan_share: float = 0.0

    def __post_init__(self) -> None:
        require(self.frames >= 1, f"Camera.frames is {self.frames}: at least 1 is needed")
        require(min(self.pixels) >= 2, f"Camera.pixels is {self.pixels}: 2 x 2 or more are needed")
        require(
            all(0 < fov < 170 for fov in self.fov_deg),
            f"Camera.fov_deg is {self.fov_deg}: angles above 0 and below 170 are needed",
        )
        require(
            0 <= self.range_m[0] < self.range_m[1],
            f"Camera.range_m is {self.range_m}: nearest before farthest is needed",
        )
        require_positive(self, "height_m")
        require_not_negative(self, "rail_m", "noise_m", "noise_max_m", "frame_bias_m")
        require_not_negative(self, "shift_m", "turn_deg")
        require(
            0 <= self.flying_share <= 1,
            f"Camera.flying_share is {self.flying_share}: a share from 0 to 1 is needed",
        )
        require_share(self, "stray_share", "zero_share", "nan_share")
        require(
            self.zero_share + self.nan_share < 1,
            f"Camera.zero_share and nan_share are {self.zero_share} and {self.nan_share}: "
            "a sum below 1 is needed",
        )


@dataclass(frozen=True)
class Scene:
    """All that a simulated scan depends on, except the seed.

    Parameters
    ----------
    floor, piles, things, camera
        The objects, and the camera.
    pose
        Rigid motion from the scene's frame to the scan's.
    unit_m
        Metres in one unit of the scan's coordinates.
    fuse_voxel_m
        Edge of the voxels in which the frames' points are averaged; 0 keeps every point.
    strip_m
        Length and width of the measured strip, centred at the origin, which holds all piles.
    ghosts
        Returns that come from no surface.
    copies, copied_beyond_m
        Number of copies of each point with an x, in the scene, above a value.
    most_points
        Number of points that are kept, drawn at random; None for all.
    vessel
        The vessel that holds the pile, with given floor and outline, if any.
    name
        Part of the seed of random draws, so that scenes with different names differ.
    """

    floor: Floor = field(default_factory=Floor)
    piles: tuple[Pile, ...] = ()
    things: tuple[Thing, ...] = ()
    camera: Camera = field(default_factory=Camera)
    pose: Pose = field(default_factory=Pose)
    unit_m: float = 1.0
    fuse_voxel_m: float = 0.0032
    strip_m: XY | None = None
    ghosts: Ghosts = field(default_factory=Ghosts)
    copies: int = 1
    copied_beyond_m: float = -math.inf
    most_points: int | None = None
    vessel: Vessel | None = None
    name: str = ""

    def __post_init__(self) -> None:
        require_positive(self, "unit_m")
        require_not_negative(self, "fuse_voxel_m")
        require(self.copies >= 1, f"Scene.copies is {self.copies}: at least 1 is needed")
