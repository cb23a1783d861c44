"""Depth frames of a scene, with camera poses: on a rail, hand-held, or fixed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

import numpy as np

from divespot._arguments import number, seed_number, whole, word
from divespot.errors import DivespotError
from divespot.simulate.camera import Array, fly, look_from, optical_axes, rays, sigma_m
from divespot.simulate.draw import stream
from divespot.simulate.pose import rotation
from divespot.simulate.scan import denser
from divespot.simulate.scene import Scene
from divespot.simulate.scenes import scene_named
from divespot.simulate.terrain import terrain
from divespot.simulate.things import Person

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.simulate.camera import View
    from divespot.simulate.scene import Camera

Path: TypeAlias = Literal["rail", "hand", "fixed"]

HAND_FRAMES, HAND_HZ = 45, 15.0
"""Number of frames of a hand-held camera: three seconds."""
FIXED_FRAMES = 30
"""Number of frames of a fixed camera."""
SHAKE_M, SHAKE_DEG = 0.006, 0.7
"""Amplitudes of the hand's tremors, along and about each axis."""
TREMORS_HZ = (0.7, 1.6, 3.1)
"""Their frequencies."""
WALK_HZ = 0.3
"""How often per second a hand moves to and fro along the rail's path."""
WALKING = 1 / 3
"""Share of the frames of a fixed camera in which somebody walks through."""
STEP_M = 0.001
"""Metres per unit of the depth images."""


@dataclass(frozen=True, eq=False)
class SimulatedFrames:
    """Depth frames and the truth about them.

    Attributes
    ----------
    depth
        (n, rows, columns) uint16, in millimetres along the optical axis; 0 for pixels without
        depth.
    matrix
        (3, 3) the camera's intrinsic matrix.
    poses
        (n, 4, 4) rigid motion of each frame, from its camera (x right, y down, z ahead) to the
        scene, in metres.
    volumes_m3
        Exact volume of each pile above the floor.
    scene
        The scene.
    """

    depth: NDArray[np.uint16]
    matrix: Array
    poses: Array
    volumes_m3: tuple[float, ...]
    scene: Scene

    @property
    def volume_m3(self) -> float:
        """Exact volume of all piles."""
        return sum(self.volumes_m3)


def frames(  # noqa: PLR0913 - as those of `scan`, and the path
    scene: Scene | str,
    *,
    path: Path = "rail",
    count: int | None = None,
    seed: int = 0,
    repeat: int = 0,
    density: float = 1.0,
) -> SimulatedFrames:
    """Simulate the depth frames of a camera that moves along a path.

    Parameters
    ----------
    scene
        A scene, or the name of one (`NAMES`).
    path
        ``"rail"``: the camera of the scene on its rail. ``"hand"``: the same path hand-held, to and
        fro, shaking, at 15 Hz. ``"fixed"``: no motion, with somebody walking through a third of the
        frames.
    count
        Number of frames; by default those of the scene's rail, 45 hand-held, 30 fixed.
    seed, repeat, density
        As for `scan`.

    Raises
    ------
    DivespotError
        If the name or the path is unknown, or the scene is impossible.

    Examples
    --------
    >>> from divespot import simulate
    >>> taken = simulate.frames("shape-05", density=0.01)
    >>> taken.depth.shape, taken.poses.shape
    ((4, 64, 58), (4, 4, 4))

    """
    seed, repeat = seed_number(seed), whole("repeat", repeat)
    if word("path", path) not in get_args(Path):
        raise DivespotError(f"path is {path!r}: one of {', '.join(get_args(Path))} is needed")
    scene = scene_named(scene, seed) if isinstance(scene, str) else scene
    if not isinstance(scene, Scene):
        raise DivespotError(f"scene is a {type(scene).__name__}: a Scene or a name is needed")
    scene = denser(scene, number("density", density))
    places = poses(scene, path, _count(scene, path, count), stream(seed, f"{scene.name} {path}"))
    scene = _peopled(scene, path, len(places))
    surface, volumes_m3 = terrain(scene, seed)
    own = rays(replace(scene.camera, pitch_deg=0.0)) @ optical_axes(
        replace(scene.camera, pitch_deg=0.0)
    )
    depth = np.zeros((len(places), scene.camera.pixels[1], scene.camera.pixels[0]), np.uint16)
    for frame, pose in enumerate(places):
        view = look_from(pose[:3, 3], scene, surface, frame, own @ pose[:3, :3].T)
        rng = stream(seed, f"{scene.name} noise", repeat, frame)
        depth[frame] = image(view, scene.camera, own[:, 2], rng)
    return SimulatedFrames(depth, matrix(scene.camera), places, volumes_m3, scene)


def image(view: View, camera: Camera, along: Array, rng: np.random.Generator) -> NDArray[np.uint16]:
    """Return the depth image of a view; `along` are the rays' components along the axis."""
    distance_m, _ = fly(view, camera, rng)
    near_m, far_m = camera.range_m
    valid = (distance_m > near_m) & (distance_m < far_m)
    distance_m = np.where(valid, distance_m, 0.0) + camera.bias_m
    distance_m += rng.normal(0, camera.frame_bias_m)
    distance_m += sigma_m(camera, distance_m) * rng.standard_normal(distance_m.size)
    steps = np.where(valid, np.rint(distance_m * along / STEP_M), 0)
    columns, rows = camera.pixels
    return np.asarray(np.clip(steps, 0, 65535).astype(np.uint16).reshape(rows, columns))


def matrix(camera: Camera) -> Array:
    """(3, 3) intrinsic matrix of a camera; the centre of the first pixel is (0, 0)."""
    (columns, rows), (across, down) = camera.pixels, camera.fov_deg
    fx = columns / 2 / math.tan(math.radians(across) / 2)
    fy = rows / 2 / math.tan(math.radians(down) / 2)
    return np.array([[fx, 0, (columns - 1) / 2], [0, fy, (rows - 1) / 2], [0, 0, 1]])


def _count(scene: Scene, path: Path, count: int | None) -> int:
    usual = {"rail": scene.camera.frames, "hand": HAND_FRAMES, "fixed": FIXED_FRAMES}[path]
    found = whole("count", usual if count is None else count)
    if found < 1:
        raise DivespotError("count is 0: at least 1 frame is needed")
    return found


def poses(scene: Scene, path: Path, count: int, rng: np.random.Generator) -> Array:
    """(count, 4, 4) poses of the camera along a path."""
    camera = replace(scene.camera, frames=count)
    axes = optical_axes(camera)
    found = np.tile(np.eye(4), (count, 1, 1))
    found[:, :3, :3] = axes
    middle = np.array([0.0, camera.offset_m, camera.height_m])
    share = np.arange(count) / max(count - 1, 1) - 0.5
    found[:, :3, 3] = middle
    if path == "rail":
        found[:, 0, 3] += share * camera.rail_m
    elif path == "hand":
        shift_m, turn_deg = _shaking(count, rng)
        time_s = np.arange(count) / HAND_HZ
        found[:, 0, 3] += 0.5 * camera.rail_m * np.sin(2 * np.pi * WALK_HZ * time_s)
        found[:, :3, 3] += shift_m
        for pose, turn in zip(found, turn_deg, strict=True):
            pose[:3, :3] = rotation(*turn) @ axes
    return found


def _shaking(count: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Shifts and turns of a hand, (count, 3) each."""
    time_s = np.arange(count)[:, None] / HAND_HZ
    shift_m, turn_deg = np.zeros((count, 3)), np.zeros((count, 3))
    for hertz in TREMORS_HZ:
        phase = rng.uniform(0, 2 * np.pi, (2, 3))
        shift_m += SHAKE_M * np.sin(2 * np.pi * hertz * time_s + phase[0])
        turn_deg += SHAKE_DEG * np.sin(2 * np.pi * hertz * time_s + phase[1])
    return shift_m, turn_deg


def _peopled(scene: Scene, path: Path, count: int) -> Scene:
    """Let somebody walk through the view of a fixed camera, instead of passing the rail."""
    if path != "fixed":
        return scene
    walking = tuple(range(count // 3, count // 3 + round(WALKING * count)))
    stride_m = 1.6 / max(len(walking), 1)
    walker = Person((-0.8, 0.15), (stride_m, 0.0), walking)
    others = tuple(thing for thing in scene.things if not isinstance(thing, Person))
    return replace(scene, things=(*others, walker))
