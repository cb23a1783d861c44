"""What voxels do to a volume: `python benches/thinned.py [SCENE...]`.

Simulated scans are measured whole, and as the means of voxels of some point spacings: as scans that
are read in one pass. Printed is what that moves each pile by, in its u95 and in percent.
"""

from __future__ import annotations

import math
import sys

import numpy as np

import divespot
from divespot import simulate
from divespot.scale import Accumulator

#: Piles in the open, of a camera, of a drone, beside a sump; with things and people over them; at
#: boards, benches, rims, cut faces and terraces.
SCENES = (
    *("shape-01", "shape-05", "shape-09", "shape-16", "varied-flown", "levels-sump"),
    *("over-conveyor", "over-person", "walls-boards", "walls-bench", "walls-rim", "cut-face"),
    "levels-terrace",
)

#: Edges of the voxels, in point spacings, and the seed of the scenes.
EDGES, SEED = (1.5, 2.5), 7


def print_scene(name: str) -> None:
    """Measure a scene both ways, and print a line an edge."""
    points = simulate.scan(name, seed=SEED).points.reshape(-1, 3)
    seen = points[np.isfinite(points).all(axis=1) & points.any(axis=1)]
    whole = divespot.measure(seen).piles
    spacing_m = divespot.point_spacing(seen)
    for edge in EDGES:
        voxels = Accumulator(edge * spacing_m, origin_m=seen.min(axis=0).tolist())
        voxels.add(seen)
        means = voxels.surfaces().means
        found = divespot.measure(means).piles
        moved = "  ".join(_moved(pile, found) for pile in whole)
        print(f"{name:14} {edge:4} {len(seen):8} -> {len(means):6}  {moved}")


def _moved(pile: divespot.Pile, found: tuple[divespot.Pile, ...]) -> str:
    if not found:
        return "lost"
    same = min(found, key=lambda other: math.dist(other.centroid_m[:2], pile.centroid_m[:2]))
    by_m3 = same.volume_m3 - pile.volume_m3
    return f"{by_m3 / pile.u95_m3:+.2f} u95 ({by_m3 / pile.volume_m3:+.2%})"


if __name__ == "__main__":
    for scene in sys.argv[1:] or SCENES:
        print_scene(scene)
