"""Objects around a measured strip, never in it."""

from __future__ import annotations

import numpy as np

from divespot.simulate.things import XY, Box, Person, Rod, Thing, Wall


def around(strip_m: XY, frames: int, rng: np.random.Generator) -> tuple[Thing, ...]:
    """Draw a wall on one long side, supports, boxes at the ends, a person passing opposite."""
    side = rng.choice([-1, 1])
    return (
        wall_along(strip_m, side, rng),
        *supports(strip_m, rng),
        *boxes(strip_m, rng),
        passer_by(strip_m, -side, frames, rng),
    )


def boxes_around(strip_m: XY, size_m: float, rng: np.random.Generator) -> tuple[Thing, ...]:
    """Draw boxes at the ends of a strip whose largest pile has a radius of `size_m`."""
    # Box sizes are for piles with a radius of a third of a metre.
    scale = size_m / 0.35
    length_m, width_m = strip_m
    return tuple(
        Box(
            (scale * box.center_m[0], scale * box.center_m[1]),
            (scale * box.size_m[0], scale * box.size_m[1], scale * box.size_m[2]),
            box.heading_deg,
        )
        for box in boxes((length_m / scale, width_m / scale), rng)
    )


def wall_along(strip_m: XY, side: int, rng: np.random.Generator) -> Wall:
    """Wall beside the strip, from somewhere before its start to somewhere near its end."""
    y = side * (strip_m[1] / 2 + rng.uniform(0.25, 0.4))
    start, end = -strip_m[0] / 2 - rng.uniform(0.3, 0.9), strip_m[0] * rng.uniform(0.1, 0.6)
    return Wall((start, y), (end, y), height_m=rng.uniform(0.5, 1.0))


def supports(strip_m: XY, rng: np.random.Generator) -> list[Rod]:
    """Rods that carry the rail, just outside three of the strip's corners."""
    x, y = strip_m[0] / 2 + rng.uniform(0.05, 0.15), strip_m[1] / 2 + 0.08
    radius_m = rng.uniform(0.012, 0.022)
    corners = [(-x, -y), (-x, y), (x, -y), (x, y)]
    return [Rod(corners[i], radius_m) for i in rng.permutation(4)[:3]]


def boxes(strip_m: XY, rng: np.random.Generator) -> list[Box]:
    """Boxes beyond the strip's two ends, one behind the other."""
    found = []
    for end in (-1, 1):
        x = strip_m[0] / 2 + 0.2
        for _ in range(rng.integers(1, 3)):
            size = (rng.uniform(0.12, 0.35), rng.uniform(0.12, 0.35), rng.uniform(0.06, 0.4))
            # A box turned by any angle stays within half its diagonal.
            half_m = float(np.hypot(size[0], size[1])) / 2
            y = rng.uniform(-0.3, 0.3) * strip_m[1]
            found.append(Box((end * (x + half_m), y), size, rng.uniform(0, 90)))
            x += 2 * half_m + 0.03
    return found


def passer_by(strip_m: XY, side: int, frames: int, rng: np.random.Generator) -> Person:
    """Someone who walks along the strip during one or two of the frames."""
    start = int(rng.integers(0, max(1, frames - 1)))
    place = (rng.uniform(-0.4, 0.4) * strip_m[0], side * (strip_m[1] / 2 + 0.35))
    seen = tuple(range(start, min(frames, start + int(rng.integers(1, 3)))))
    return Person(place, (rng.uniform(0.2, 0.4), 0.0), seen, rng.uniform(1.6, 1.9))
