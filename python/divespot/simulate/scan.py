"""Simulating a scan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot._arguments import number, seed_number, whole
from divespot.errors import DivespotError
from divespot.simulate.camera import GROUND, INVALID, STRAY, THING, Labels, frame_points, rays
from divespot.simulate.draw import stream
from divespot.simulate.scene import Scene
from divespot.simulate.scenes import scene_named
from divespot.simulate.terrain import terrain

if TYPE_CHECKING:
    from divespot.simulate.surface import Surface

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SimulatedScan:
    """A scan and its truth.

    Attributes
    ----------
    points
        (n, 3) float64, in the scan's frame and unit.
    labels
        (n,) source of each point: 0 floor, k pile k, or `THING`, `FLYING`, `STRAY`, `INVALID`,
        which are negative. A fused point has the label of one of its points.
    volumes_m3
        Exact volume of each pile above the floor.
    pose
        (4, 4) rigid motion, in metres, from the scene's frame to the scan's.
    scene, seed, repeat
        What the scan was made from.
    surface
        The exact surface, in the scene's frame.
    """

    points: Array
    labels: Labels
    volumes_m3: tuple[float, ...]
    pose: Array
    scene: Scene
    seed: int
    repeat: int
    surface: Surface

    @property
    def volume_m3(self) -> float:
        """Exact volume of all piles."""
        return sum(self.volumes_m3)

    @property
    def up(self) -> Array:
        """(3,) unit vector against gravity, in the scan's frame."""
        return np.array(self.pose[:3, 2])

    def in_scene(self, positions: Array | None = None) -> Array:
        """Positions in the scan's frame and unit, by default its points, in the scene's frame.

        Returns
        -------
        positions_m
            (n, 3) or (3,), in metres.
        """
        given = self.points if positions is None else positions
        return np.asarray((given * self.scene.unit_m - self.pose[:3, 3]) @ self.pose[:3, :3])


def scan(
    scene: Scene | str, *, seed: int = 0, repeat: int = 0, density: float = 1.0
) -> SimulatedScan:
    """Scan a scene.

    Parameters
    ----------
    scene
        A scene, or the name of one (`NAMES`).
    seed
        Source of every random draw; the same seed gives the same bits.
    repeat
        Another number scans the same piles and objects again, with new noise and registration.
    density
        Number of points relative to the scene's own; changes pixels and voxels, not the piles.

    Raises
    ------
    DivespotError
        If the name is unknown or the scene is impossible.

    Examples
    --------
    >>> from divespot import simulate
    >>> one = simulate.scan("shape-05", seed=3, density=0.03)
    >>> one.points.shape[1], round(one.volume_m3, 6)
    (3, 0.028)

    """
    seed, repeat = seed_number(seed), whole("repeat", repeat)
    if isinstance(scene, str):
        scene = scene_named(scene, seed)
    if not isinstance(scene, Scene):
        raise DivespotError(f"scene is a {type(scene).__name__}: a Scene or a name is needed")
    scene = denser(scene, density)
    surface, volumes_m3 = terrain(scene, seed)
    directions = rays(scene.camera)
    frames = [
        frame_points(scene, surface, frame, directions, (seed, repeat))
        for frame in range(scene.camera.frames)
    ]
    points = np.concatenate([points for points, _ in frames])
    labels = np.concatenate([labels for _, labels in frames])
    del frames
    pose = scene.pose.matrix()
    # Frames are fused in the scan's axes, to which the floor is oblique, but near the origin.
    points, labels = fuse(points @ pose[:3, :3].T, labels, scene.fuse_voxel_m)
    points, labels = _with_strays(
        points @ pose[:3, :3], labels, scene, stream(seed, f"{scene.name} strays", repeat)
    )
    below = stream(seed, f"{scene.name} below", repeat)
    points, labels = _with_low(points, labels, scene, surface, below)
    points, labels = _sampled(points, labels, scene, stream(seed, f"{scene.name} sampling", repeat))
    points = (points @ pose[:3, :3].T + pose[:3, 3]) / scene.unit_m
    points, labels = _with_invalid(
        points, labels, scene, stream(seed, f"{scene.name} invalid", repeat)
    )
    return SimulatedScan(points, labels, volumes_m3, pose, scene, seed, repeat, surface)


def denser(scene: Scene, density: float) -> Scene:
    """Return a scene with more pixels and smaller voxels, or fewer and larger ones."""
    if not 0 < number("density", density) <= 100:
        raise DivespotError(f"density is {density}: a number above 0 and up to 100 is needed")
    finer = density**0.5
    columns, rows = (max(2, round(n * finer)) for n in scene.camera.pixels)
    camera = replace(scene.camera, pixels=(columns, rows))
    return replace(scene, camera=camera, fuse_voxel_m=scene.fuse_voxel_m / finer)


def fuse(points: Array, labels: Labels, voxel_m: float) -> tuple[Array, Labels]:
    """Mean of the points in each cube of edge `voxel_m`, with the label of its first point."""
    if voxel_m == 0 or not len(points):
        return points, labels
    cube = np.floor(points / voxel_m).astype(np.int64)
    cube -= cube.min(axis=0)
    counts = cube.max(axis=0) + 1
    key = (cube[:, 0] * counts[1] + cube[:, 1]) * counts[2] + cube[:, 2]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    size = np.diff(first, append=len(points))
    means = np.add.reduceat(points[order], first) / size[:, None]
    return means, labels[order[first]]


def _with_strays(
    points: Array, labels: Labels, scene: Scene, rng: np.random.Generator
) -> tuple[Array, Labels]:
    """Add points at random in a slightly enlarged box around the others."""
    share = scene.camera.stray_share
    count = round(len(points) * share / (1 - share))
    if not len(points):
        return points, labels
    low, high = points.min(axis=0), points.max(axis=0)
    spare = 0.03 * (high - low).max()
    strays = rng.uniform(low - spare, high + spare, (count, 3))
    return _append(points, strays, labels, STRAY)


def _with_low(
    points: Array, labels: Labels, scene: Scene, surface: Surface, rng: np.random.Generator
) -> tuple[Array, Labels]:
    """Add the points that come from below the floor."""
    raised = (labels > GROUND) | (labels == THING)
    low = scene.ghosts.below(points[raised], points[labels == GROUND], surface, rng)
    return _append(points, low, labels, STRAY)


def _sampled(
    points: Array, labels: Labels, scene: Scene, rng: np.random.Generator
) -> tuple[Array, Labels]:
    """Repeat points, then keep some of them, in their order."""
    number = np.arange(len(points))
    again = number[points[:, 0] > scene.copied_beyond_m]
    number = np.concatenate([number, *[again] * (scene.copies - 1)])
    if scene.most_points is not None and scene.most_points < len(number):
        number = number[np.sort(rng.permutation(len(number))[: scene.most_points])]
    return points[number], labels[number]


def _with_invalid(
    points: Array, labels: Labels, scene: Scene, rng: np.random.Generator
) -> tuple[Array, Labels]:
    """Put (0, 0, 0) and NaN rows among the points."""
    camera = scene.camera
    if camera.zero_share == camera.nan_share == 0:
        return points, labels
    total = len(points) / (1 - camera.zero_share - camera.nan_share)
    zeros = np.zeros((round(total * camera.zero_share), 3))
    nans = np.full((round(total * camera.nan_share), 3), np.nan)
    points, labels = _append(points, np.concatenate([zeros, nans]), labels, INVALID)
    order = rng.permutation(len(points))
    return points[order], labels[order]


def _append(points: Array, more: Array, labels: Labels, label: int) -> tuple[Array, Labels]:
    extra = np.full(len(more), label, dtype=np.int16)
    return np.concatenate([points, more]), np.concatenate([labels, extra])
