"""Sites measured window by window: `python benches/sites.py [SITE...] [--folder FOLDER]`.

Each site is a chessboard of squares with a pile in the middle of each, most of them 2 m wide, and
is written as LAZ and measured in a process of its own. Printed are its time, its peak memory and
how the piles come out.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import divespot
import divespot.too_large
from yard import CORNER_M, NOISE_M, SLOPE, STEEP, write_las

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

#: Radii of cones, square by square.
RADII_M = (1.0, 1.0, 4.0, 1.0, 1.0, 1.0, 10.0)


@dataclass(frozen=True)
class Site:
    """Squares of an edge `square_m`, their middles `pitch_m` apart, points `step_m` apart."""

    squares: int
    square_m: float
    pitch_m: float
    step_m: float

    def middles_m(self) -> list[tuple[float, float]]:
        """Return the middles of the squares."""
        at = (np.arange(self.squares) + 0.5) * self.pitch_m
        return [(x, y) for y in at.tolist() for x in at.tolist()]

    def radius_m(self, number: int) -> float:
        """Return the radius of the pile in a square."""
        return RADII_M[number % len(RADII_M)]


#: A quarter hectare to a sixteenth of a square kilometre in full, and squares of a whole one.
SITES = {
    "full-0.025-km2": Site(5, 31.6, 31.6, 0.05),
    "full-0.0625-km2": Site(8, 31.25, 31.25, 0.05),
    "scattered-1-km2": Site(8, 25.0, 125.0, 0.05),
    "thin-1-km2": Site(16, 62.5, 62.5, 0.2),
}


def squares(site: Site) -> Iterator[NDArray[np.float64]]:
    """Yield the points of a site, square by square."""
    rng = np.random.default_rng(0)
    across = round(site.square_m / site.step_m)
    for number, middle in enumerate(site.middles_m()):
        cells = np.indices((across, across)).reshape(2, -1)
        x, y = (cells + rng.random(cells.shape)) * (site.square_m / across)
        x, y = x + middle[0] - 0.5 * site.square_m, y + middle[1] - 0.5 * site.square_m
        out = np.hypot(x - middle[0], y - middle[1])
        z = SLOPE * x + STEEP * np.maximum(0.0, site.radius_m(number) - out)
        yield np.column_stack([x, y, z + rng.normal(0.0, NOISE_M, len(x))])


def measured(path: Path, site: Site) -> dict[str, Any]:
    """Measure a site in windows, whatever its size, and hold its piles against the truth."""
    divespot.too_large.MOST_HELD = 0
    began = time.perf_counter()
    report = divespot.measure(path)
    took = time.perf_counter() - began
    used = resource.getrusage(resource.RUSAGE_SELF)
    at = np.array([pile.centroid_m[:2] for pile in report.piles]) - CORNER_M[:2]
    errors, inside = [], 0
    for number, middle in enumerate(site.middles_m()):
        apart = np.hypot(*(at - middle).T)
        if apart.min(initial=math.inf) > 0.5:
            continue
        pile = report.piles[int(apart.argmin())]
        off = pile.volume_m3 - math.pi / 3.0 * STEEP * site.radius_m(number) ** 3
        errors.append(abs(off) / (pile.volume_m3 - off))
        inside += abs(off) <= pile.u95_m3
    return {
        "points": report.source.points,
        "of": len(site.middles_m()),
        "piles": len(report.piles),
        "found": len(errors),
        "inside": inside,
        "mean": float(np.mean(errors)),
        "worst": max(errors),
        "wall_s": took,
        "windows_s": report.timings_s["windows"],
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
        "told": [text for text in report.warnings if "voxels" in text],
    }


def print_site(name: str, folder: Path) -> None:
    """Write a site, measure it in a process of its own, and print what came of it."""
    path = folder / f"{name}.laz"
    if not path.exists():
        write_las(path, squares(SITES[name]))
    command = [sys.executable, __file__, "--run", name, str(path)]
    ended = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE)
    got = json.loads(ended.stdout.splitlines()[-1])
    print(
        f"{name}: {got['points']} points, {got['wall_s']:.0f} s, of it windows "
        f"{got['windows_s']:.0f} s, {got['cpu_s']:.0f} CPU s, {got['peak_mb']:.0f} MB\n"
        f"    {got['found']} of {got['of']} piles and {got['piles'] - got['found']} others, errors "
        f"{got['mean']:.2%}, at most {got['worst']:.2%}, {got['inside']} inside u95"
    )
    print(*(f"    {text}" for text in got["told"]), sep="\n")


def main() -> None:
    """Write the sites, measure them, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sites", nargs="*", help=", ".join(SITES))
    parser.add_argument("--folder", type=Path, help="where the sites are kept")
    parser.add_argument("--run", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.run:
        print(json.dumps(measured(Path(given.run[1]), SITES[given.run[0]])))
        return
    with tempfile.TemporaryDirectory() as temporary:
        for name in given.sites or SITES:
            print_site(name, given.folder or Path(temporary))


if __name__ == "__main__":
    main()
