"""Scenes of exact arithmetic, and what is measured in them to the last bit.

Sums, products, quotients and roots are rounded alike on every machine, so these points are the
same everywhere, and so must be what is measured. What a change of the method or of a constant does
to it is seen: `python tests/pinned.py` writes the new figures to tests/data/pinned.json. Whether
they are right is for other tests to say.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

import divespot
from divespot.frames import fuse

Floats: TypeAlias = NDArray[Any]
Height: TypeAlias = Callable[[Floats, Floats], Floats]

KEPT = Path(__file__).parent / "data" / "pinned.json"


def evenly(count: int, seed: int) -> Floats:
    """Return numbers from 0 to 1 that look random: SplitMix64."""
    z = np.arange(count, dtype=np.uint64) + np.uint64(seed << 32)
    with np.errstate(over="ignore"):
        z = (z + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray((z ^ (z >> np.uint64(31))) >> np.uint64(11)).astype(np.float64) / 2.0**53


def noise(count: int, seed: int) -> Floats:
    """Return numbers of mean 0 and variance 1: the sum of four even ones."""
    return np.asarray((sum(evenly(count, 4 * seed + k) for k in range(4)) - 2.0) * np.sqrt(3.0))


def cone(x: Floats, y: Floats, at: tuple[float, float], high: float, slope: float = 0.6) -> Floats:
    """Return the heights of a cone."""
    return np.asarray(np.maximum(0.0, high - slope * np.sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2)))


def seen_from_above(height: Height, side: tuple[float, float], seed: int, step: float) -> Floats:
    """Return points on a surface, one in each square, with 2 mm of noise."""
    columns, rows = (round(length / step) for length in side)
    cells = np.arange(columns * rows)
    x = (cells % columns + evenly(len(cells), seed)) * step
    y = (cells // columns + evenly(len(cells), seed + 1)) * step
    return np.column_stack([x, y, height(x, y) + 0.002 * noise(len(x), seed + 2)])


def upright(x: Floats, y: Floats, low: float, high: float, layers: int) -> Floats:
    """Return points on something upright, above each place."""
    z = low + (high - low) * np.arange(layers) / (layers - 1)
    return np.column_stack([np.repeat(x, layers), np.repeat(y, layers), np.tile(z, len(x))])


def lit(points: Floats, lamp: tuple[float, float, float], blocker: Floats) -> Floats:
    """Leave out what is behind a blocker, a box (low and high corner), seen from a lamp."""
    eye = np.array(lamp)
    way = points - eye
    with np.errstate(divide="ignore", invalid="ignore"):
        to = (blocker[:, None, :] - eye) / way
    first, last = np.fmin(*to).max(axis=1), np.fmax(*to).min(axis=1)
    return np.asarray(points[~((first < last) & (first > 0.0) & (first < 0.98))])


def heap() -> Floats:
    """Return a cone on a floor that falls to one side."""
    return seen_from_above(
        lambda x, y: cone(x, y, (1.0, 0.9), 0.35) + 0.02 * x, (2.0, 1.8), 1, 0.016
    )


def two_and_a_person() -> Floats:
    """Return two cones that touch, somebody on a flank, what they hide, and points in the air."""
    surface = seen_from_above(
        lambda x, y: np.maximum(cone(x, y, (1.1, 1.0), 0.4), cone(x, y, (1.8, 1.1), 0.3)),
        (3.0, 2.0),
        10,
        0.02,
    )
    box = np.array([[1.45, 0.5, 0.0], [1.65, 0.65, 1.1]])
    edge = np.arange(14) * 0.0125
    front = upright(1.45 + edge, np.full(14, 0.5), 0.2, 1.1, 60)
    side = upright(np.full(11, 1.45), 0.5 + np.arange(11) * 0.0125, 0.2, 1.1, 60)
    air = np.column_stack([evenly(40, 90 + k) * (3.0, 2.0, 1.5)[k] for k in range(3)])
    return np.vstack([lit(surface, (1.2, -2.0, 2.5), box), front, side, air])


def bay() -> Floats:
    """Return a heap in the corner of two walls, one of which hides some of the floor."""
    surface = seen_from_above(lambda x, y: cone(x, y, (0.6, 0.5), 0.5), (2.4, 2.0), 20, 0.02)
    along = np.arange(120) * 0.02
    back = upright(np.zeros(100), along[:100], 0.0, 0.9, 46)
    other = upright(along, np.zeros(120), 0.0, 0.9, 46)
    return np.vstack([surface, back, other])


def two_levels() -> Floats:
    """Return a cone on each of two levels, with a bank between them, and a pit."""

    def height(x: Floats, y: Floats) -> Floats:
        bank = np.clip((x - 1.5) * 0.8, 0.0, 0.3)
        heaps = cone(x, y, (0.8, 1.2), 0.25) + cone(x, y, (2.9, 0.8), 0.3)
        return np.asarray(bank + heaps - cone(x, y, (0.6, 0.35), 0.12))

    return seen_from_above(height, (3.8, 2.0), 30, 0.02)


def boxes() -> Floats:
    """Return a carton, a ridge with a flat top, and a heap at the edge of the scan."""

    def height(x: Floats, y: Floats) -> Floats:
        carton = np.where((np.abs(x - 0.5) < 0.2) & (np.abs(y - 0.6) < 0.15), 0.25, 0.0)
        ridge = np.minimum(np.maximum(0.0, 0.4 - 0.7 * np.abs(x - 1.7)), 0.2)
        ridge *= np.abs(y - 1.0) < 0.6
        return np.asarray(np.maximum(carton, ridge) + cone(x, y, (2.9, 1.9), 0.3))

    return seen_from_above(height, (3.0, 2.0), 40, 0.02)


def wavy() -> Floats:
    """Return a heap on ground of waves, seen by a scanner on a tripod: dense near, sparse far."""
    place = np.sqrt(evenly(9000, 50)) * evenly(9000, 51)
    x, y = place * 4.0, (evenly(9000, 52) - 0.5) * 3.0
    waves = 0.03 * (x - 2.0) * y * (1.0 - 0.2 * y * y)
    z = waves + cone(x, y, (1.8, 0.2), 0.4) + 0.003 * noise(9000, 53)
    return np.column_stack([x + 4.0e5, y + 5.0e6, z + 300.0])


#: Each scene, and settings to measure it with.
SCANS: dict[str, tuple[Callable[[], Floats], dict[str, Any]]] = {
    "heap": (heap, {}),
    "heap, the paper's way": (heap, {"settings": divespot.Settings.paper()}),
    "heap in an outline": (heap, {"inside": (0.35, 0.3, 1.65, 1.55)}),
    "two and a person": (two_and_a_person, {"material": "corn"}),
    "bay": (bay, {}),
    "two levels": (two_levels, {"up": "z"}),
    "two levels, all bases": (two_levels, {"up": "z", "compare_bases": True}),
    "boxes": (boxes, {"up": "z"}),
    "wavy": (wavy, {}),
}


def depth_mm(eye: tuple[float, float, float], lean: tuple[float, float], seed: int) -> Floats:
    """Return a depth image of a cone on a floor and of a wall, seen from above, in mm.

    `lean` are the sine and the cosine by which the camera is turned about its x axis.
    """
    columns, rows = np.meshgrid(np.arange(WIDE) - 0.5 * WIDE, np.arange(HIGH) - 0.5 * HIGH)
    x, y, z = columns / FOCAL, rows / FOCAL, np.ones_like(columns)
    sine, cosine = lean
    ray = np.stack([x, -(cosine * y - sine * z), -(sine * y + cosine * z)])
    floor = -eye[2] / ray[2]
    wall = np.where(ray[1] > 0, (1.1 - eye[1]) / np.where(ray[1] > 0, ray[1], 1.0), np.inf)
    far = np.minimum(floor, wall)
    for _ in range(60):  # the cone is met where a ray first is below it
        at = [eye[k] + far * ray[k] for k in range(3)]
        below = cone(at[0], at[1], (0.0, 0.0), 0.3) - at[2]
        far = np.where(below > 0.0, far + 0.5 * below / ray[2], far)
    grain = 1.5 * noise(far.size, seed).reshape(far.shape)
    return np.asarray(np.rint(1000.0 * far + grain))


WIDE, HIGH, FOCAL = 96, 72, 80.0
#: Leans of rational sine and cosine: Pythagorean triples.
LEAN = (28.0 / 197.0, 195.0 / 197.0)
LEANS = (LEAN, (20.0 / 101.0, 99.0 / 101.0), (0.0, 1.0), (36.0 / 325.0, 323.0 / 325.0))


def frames() -> NDArray[np.uint16]:
    """Return depth images of a camera that passes over a cone, and wanders."""
    way = [(-0.5, -0.3, 1.4), (-0.25, -0.28, 1.42), (0.0, -0.32, 1.4), (0.22, -0.3, 1.38)]
    views = [depth_mm(eye, LEAN, 70 + i) for i, eye in enumerate([*way, (0.45, -0.25, 1.41)])]
    return np.stack(views).astype(np.uint16)


def round_about() -> NDArray[np.uint16]:
    """Return depth images of a hand that goes round a cone; one is of something else."""
    way = [(0.6, 0.0), (0.4, 0.4), (0.0, 0.55), (-0.4, 0.4), (-0.6, 0.0), (-0.4, -0.45)]
    way += [(0.0, -0.6), (0.4, -0.45), (0.58, -0.05), (0.3, 0.1), (0.0, 0.0), (-0.3, -0.1)]
    views = [
        depth_mm((0.8 * x, 0.8 * y - 0.3, 1.3 + 0.05 * (i % 3)), LEANS[i % 4], 100 + i)
        for i, (x, y) in enumerate(way)
    ]
    views.insert(5, 500.0 + np.rint(900.0 * evenly(WIDE * HIGH, 99).reshape(HIGH, WIDE)))
    return np.stack(views).astype(np.uint16)


def still() -> NDArray[np.uint16]:
    """Return depth images of a camera that does not move, before which somebody passes."""
    views = np.stack([depth_mm((0.0, -0.3, 1.4), LEAN, 80 + i) for i in range(9)])
    for i in range(5):
        views[i, 20:60, 12 * i : 12 * i + 14] = 700.0
    return views.astype(np.uint16)


CAMERA = np.array([[FOCAL, 0.0, 0.5 * WIDE], [0.0, FOCAL, 0.5 * HIGH], [0.0, 0.0, 1.0]])
SEQUENCES: dict[str, Callable[[], NDArray[np.uint16]]] = {
    "frames": frames,
    "round about": round_about,
    "still": still,
}


def figures(name: str) -> Any:  # noqa: ANN401 - as JSON has it
    """Return what is measured in a scene."""
    if name in SEQUENCES:
        scan = fuse(SEQUENCES[name](), CAMERA)
        report = divespot.measure(scan)
    else:
        points, settings = SCANS[name]
        report = divespot.measure(points(), **settings)
    kept = json.loads(report.to_json())
    for left_out in ("timings_s", "version", "settings", "source"):
        kept.pop(left_out, None)
    for item in (*kept["piles"], *kept["other_objects"]):
        item.pop("outline_m", None)
    if name in SEQUENCES:
        assert scan.registration is not None
        kept["registration"] = json.loads(
            json.dumps(dataclasses.asdict(scan.registration), default=np.ndarray.tolist)
        )
    return kept


def main() -> None:
    """Write all figures."""
    found = {name: figures(name) for name in (*SCANS, *SEQUENCES)}
    KEPT.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
