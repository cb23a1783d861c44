"""The camera's measurements of a scene, frame by frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot.errors import DivespotError
from divespot.simulate.draw import stream
from divespot.simulate.ghosts import Ghosts
from divespot.simulate.pose import rotation
from divespot.simulate.thing_solids import foot_z_m, solids_of
from divespot.simulate.trace import meet_surface
from divespot.simulate.tripod import Tripod

if TYPE_CHECKING:
    from divespot.simulate.scene import Camera, Scene
    from divespot.simulate.solids import Solid
    from divespot.simulate.surface import Surface

Array = NDArray[np.float64]
Labels = NDArray[np.int16]

GROUND, THING, FLYING, STRAY, INVALID = 0, -1, -2, -3, -4
"""Source of a point; a pile's points have its number, from 1."""
EDGE_SHARE = 0.02
"""Two neighbouring pixels whose distances differ by a larger share are on a depth edge."""


def lens(camera: Camera, frame: int) -> Array:
    """(3,) position of the lens in the scene."""
    if isinstance(camera, Tripod):
        return camera.lens(frame)
    share = frame / (camera.frames - 1) - 0.5 if camera.frames > 1 else 0.0
    return np.array([share * camera.rail_m, camera.offset_m, camera.height_m])


def optical_axes(camera: Camera) -> Array:
    """(3, 3) matrix whose columns are the camera's right, down and forward in the scene."""
    return rotation(180 + camera.pitch_deg, 0, 0)


def rays(camera: Camera) -> Array:
    """(rows * columns, 3) unit vectors through the centres of the pixels, in the scene."""
    if isinstance(camera, Tripod):
        return camera.rays()
    columns, rows = (
        math.tan(math.radians(fov) / 2) * ((2 * np.arange(n) + 1) / n - 1)
        for n, fov in zip(camera.pixels, camera.fov_deg, strict=True)
    )
    right, down = np.meshgrid(columns, rows)
    own = np.stack([right.ravel(), down.ravel(), np.ones(right.size)])
    return np.asarray((optical_axes(camera) @ (own / np.linalg.norm(own, axis=0))).T)


def sigma_m(camera: Camera, distance_m: Array) -> Array:
    """Return the standard deviation of the noise along the ray."""
    return np.minimum(camera.noise_m * distance_m**camera.noise_power, camera.noise_max_m)


@dataclass(frozen=True)
class View:
    """Noiseless distance and label of each pixel of a frame."""

    distance_m: Array
    label: Labels


def look(scene: Scene, surface: Surface, frame: int, directions: Array) -> View:
    """Find what each pixel of a frame sees first.

    Raises
    ------
    DivespotError
        If the lens is under the surface.
    """
    return look_from(lens(scene.camera, frame), scene, surface, frame, directions)


def look_from(origin: Array, scene: Scene, surface: Surface, frame: int, directions: Array) -> View:
    """Find what each pixel sees first from `origin`, with moving objects as in a frame.

    Raises
    ------
    DivespotError
        If `origin` is under the surface.
    """
    if origin[2] <= surface.z(origin[:1], origin[1:2])[0]:
        raise DivespotError(f"the lens is at {origin}, under the surface: a higher one is needed")
    distance_m = meet_surface(surface, origin, directions)
    seen = np.isfinite(distance_m)
    label = np.full(len(directions), INVALID, dtype=np.int16)
    at = origin[:2] + distance_m[seen, None] * directions[seen, :2]
    label[seen] = surface.owner_at(at[:, 0], at[:, 1])
    for thing in scene.things:
        for solid in solids_of(thing, frame, foot_z_m(thing, frame, surface)):
            facing = _facing(solid, origin, directions)
            before_m = solid.meet(origin, directions[facing])
            nearer = before_m < distance_m[facing]
            distance_m[facing[nearer]] = before_m[nearer]
            label[facing[nearer]] = THING
    return View(distance_m, label)


def _facing(solid: Solid, origin: Array, directions: Array) -> NDArray[np.intp]:
    """Pixels whose ray comes near a solid; the others need not be tested."""
    middle, radius_m = solid.ball()
    towards = middle - origin
    away_m = float(np.linalg.norm(towards))
    if away_m <= radius_m:
        return np.arange(len(directions))
    along_m = directions @ towards
    return np.flatnonzero(along_m > math.sqrt(away_m**2 - radius_m**2))


def measure(
    view: View, camera: Camera, rng: np.random.Generator, directions: Array
) -> tuple[Array, Array, Labels]:
    """Distances, rays and labels of a frame's valid pixels, with the sensor's noise."""
    distance_m, label = fly(view, camera, rng)
    near_m, far_m = camera.range_m
    valid = (distance_m > near_m) & (distance_m < far_m)
    distance_m = distance_m[valid]
    distance_m += camera.bias_m + rng.normal(0, camera.frame_bias_m)
    distance_m += sigma_m(camera, distance_m) * rng.standard_normal(distance_m.size)
    return distance_m, directions[valid], label[valid]


def fly(view: View, camera: Camera, rng: np.random.Generator) -> tuple[Array, Labels]:
    """Mix foreground and background in some of the pixels at depth edges."""
    columns, rows = camera.pixels
    distance_m, label = view.distance_m.copy(), view.label.copy()
    numbers = np.arange(distance_m.size).reshape(rows, columns)
    pairs = [(numbers[:, :-1], numbers[:, 1:]), (numbers[:-1], numbers[1:])]
    one, other = (np.concatenate([side[i].ravel() for side in pairs]) for i in (0, 1))
    with np.errstate(invalid="ignore"):
        jump_m = np.abs(view.distance_m[one] - view.distance_m[other])
    nearer_m = np.minimum(view.distance_m[one], view.distance_m[other])
    edge = np.flatnonzero(np.isfinite(jump_m) & (jump_m > EDGE_SHARE * nearer_m))
    chosen = edge[rng.random(edge.size) < camera.flying_share]
    # Each edge is one pair of pixels, either of which may be the mixed one.
    swap = rng.random(chosen.size) < 0.5
    pixel = np.where(swap, other[chosen], one[chosen])
    share = rng.random(chosen.size)
    distance_m[pixel] = (1 - share) * view.distance_m[one[chosen]] + share * view.distance_m[
        other[chosen]
    ]
    label[pixel] = FLYING
    return distance_m, label


def _with_ghosts(
    view: View, ghosts: Ghosts, origin: Array, directions: Array, rng: np.random.Generator
) -> View:
    distance_m = ghosts.along(view.distance_m, origin, directions, rng)
    own = distance_m == view.distance_m
    return View(distance_m, np.where(own, view.label, np.int16(STRAY)))


def frame_points(
    scene: Scene, surface: Surface, frame: int, directions: Array, seeds: tuple[int, int]
) -> tuple[Array, Labels]:
    """(n, 3) points and labels of one frame, at the positions given by registration.

    `seeds` are the scan's seed and its repeat.
    """
    seed, repeat = seeds
    camera = scene.camera
    view = look(scene, surface, frame, directions)
    if scene.ghosts != Ghosts():
        rng = stream(seed, f"{scene.name} ghosts", repeat, frame)
        view = _with_ghosts(view, scene.ghosts, lens(camera, frame), directions, rng)
    noise = stream(seed, f"{scene.name} noise", repeat, frame)
    distance_m, seen_along, label = measure(view, camera, noise, directions)
    rng = stream(seed, f"{scene.name} registration", repeat, frame)
    turn = rotation(*rng.normal(0, camera.turn_deg, 3)) if camera.turn_deg else np.eye(3)
    origin = lens(camera, frame) + rng.normal(0, 1, 3) * camera.shift_m
    return origin + distance_m[:, None] * (seen_along @ turn.T), label
