"""Floor and piles together, and the exact volume of each pile."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from divespot.errors import DivespotError
from divespot.simulate.draw import stream
from divespot.simulate.heap import heap, radius_of_cone
from divespot.simulate.plan import plan
from divespot.simulate.surface import Surface, axes, floor_heights, levels_beside
from divespot.simulate.thing_solids import solids_of
from divespot.simulate.things import Hanging, Person, RoundWall, Thing, Wall

if TYPE_CHECKING:
    from divespot.simulate.scene import Pile, Scene

Array = NDArray[np.float64]


def terrain(scene: Scene, seed: int) -> tuple[Surface, tuple[float, ...]]:
    """Build the surface of a scene and the exact volume of each of its piles, in m3.

    Raises
    ------
    DivespotError
        If a pile extends beyond the floor or the strip, or into another object.
    """
    x, y = axes(scene.floor)
    ground_m = floor_heights(scene.floor, stream(seed, f"{scene.name} floor"))
    height_m = np.zeros_like(ground_m)
    owner = np.zeros(ground_m.shape, dtype=np.int16)
    walls = leaned_walls(scene)
    for number, pile in enumerate(scene.piles, start=1):
        rows, columns = (_window(n, pile, axis) for axis, n in ((1, y), (0, x)))
        where = plan(x[columns], y[rows], pile, walls)
        rng = stream(seed, f"{scene.name} pile", number)
        own = heap(where, pile, ground_m[rows, columns], rng)
        _require_inside(own, number)
        higher = own > height_m[rows, columns]
        owner[rows, columns][higher] = number
        np.maximum(height_m[rows, columns], own, out=height_m[rows, columns])
    beside_m = levels_beside(scene.floor)
    _require_level(beside_m, owner, len(scene.piles))
    surface = Surface(x, y, ground_m + beside_m, height_m, owner)
    _require_clear(scene, surface)
    return surface, _volumes(scene, surface)


def leaned_walls(scene: Scene) -> list[Wall | RoundWall]:
    """Return the walls that piles lean on."""
    return [
        thing
        for thing in scene.things
        if isinstance(thing, RoundWall) or (isinstance(thing, Wall) and thing.leaned_on)
    ]


def _window(nodes: Array, pile: Pile, axis: int) -> slice:
    """Nodes within reach of a pile, so that a small pile on a large floor is fast."""
    radius_m = radius_of_cone(pile.volume_m3, pile.repose_deg)
    reach_m = radius_m * (2.0 + 0.5 * (pile.ridge + pile.spread))
    middle = pile.center_m[axis]
    low, high = np.searchsorted(nodes, [middle - reach_m, middle + reach_m])
    if high - low < 3:
        raise DivespotError(
            f"a pile lies at {pile.center_m}: a place on the floor is needed, or a smaller node_m"
        )
    return slice(int(low), int(high))


def _require_inside(height_m: Array, number: int) -> None:
    edges = (height_m[0], height_m[-1], height_m[:, 0], height_m[:, -1])
    if any(edge.any() for edge in edges):
        raise DivespotError(
            f"pile {number} reaches beyond the floor: a larger floor or a smaller pile is needed"
        )


def _require_level(beside_m: Array, owner: NDArray[np.int16], piles: int) -> None:
    for number in range(1, piles + 1):
        under_m = beside_m[owner == number]
        if np.ptp(under_m) > 0:
            raise DivespotError(
                f"pile {number} lies on the face of a level: another place or under_piles is needed"
            )


def _require_clear(scene: Scene, surface: Surface) -> None:
    """Check that piles are in the strip and touch only the walls they lean on."""
    rows, columns = np.nonzero(surface.height_m)
    x, y = surface.x[columns], surface.y[rows]
    strip_m = scene.strip_m or (math.inf, math.inf)
    if (np.abs(x) > strip_m[0] / 2).any() or (np.abs(y) > strip_m[1] / 2).any():
        raise DivespotError(
            f"a pile reaches beyond the strip of {strip_m} m: a larger strip is needed"
        )
    for thing in scene.things:
        if not _may_meet(thing) and _covered(thing, scene.camera.frames, x, y):
            raise DivespotError(
                f"a pile reaches into {thing}: another place for one of them is needed"
            )
    _require_held(scene, surface)


def _may_meet(thing: Thing) -> bool:
    """Return whether an object may overlap a pile."""
    match thing:
        case Wall():
            return thing.leaned_on
        case Person():
            return thing.on_pile
        case _:
            return isinstance(thing, Hanging | RoundWall)


def _covered(thing: Thing, frames: int, x: Array, y: Array) -> bool:
    return any(
        solid.covers(x, y).any() for frame in range(frames) for solid in solids_of(thing, frame, 0)
    )


def _require_held(scene: Scene, surface: Surface) -> None:
    """Check that no pile pours over the top or round the end of a wall it leans on."""
    walls = leaned_walls(scene)
    held = np.zeros(surface.height_m.shape, dtype=bool)
    behind = np.zeros_like(held)
    for wall in walls:
        (solid,) = solids_of(wall, 0, 0)
        inside = solid.covers(surface.x, surface.y[:, None])
        held |= inside & (surface.height_m < wall.height_m)
    for number, pile in enumerate(scene.piles, start=1):
        where = plan(surface.x, surface.y, pile, walls)
        open_side = where.fade > 1 - 1e-9
        behind |= (surface.owner == number) & ~open_side
    if (behind & ~held).any():
        raise DivespotError("a pile pours over or round a wall: a higher or longer wall is needed")


def _volumes(scene: Scene, surface: Surface) -> tuple[float, ...]:
    """Exact integral of each pile's own nodes, outside the walls."""
    walls = leaned_walls(scene)
    return tuple(
        plan(surface.x, surface.y, pile, walls).volume_m3(
            np.where(surface.owner == number, surface.height_m, 0.0)
        )
        for number, pile in enumerate(scene.piles, start=1)
    )
