"""How often u95 holds the truth of volumes from simulated frames whose camera's scale is drawn.

Run by hand: ``python benches/frames_coverage.py [ROUNDS] [DENSITY]``. Each round takes the next
shape, on a rail or every third time in the hand, with noise, offsets and a scale of its own: half
a part in a thousand, as a calibration leaves it and as the budget has it. A camera that knew its
scale exactly would be within u95 always, as that is most of what is left. Printed are each error
with its u95 and the largest terms, the share that held, and the root mean square of errors in parts
of the standard uncertainty, which is to be near 1.
"""

from __future__ import annotations

import dataclasses
import sys

import numpy as np

import divespot
from divespot import frames, simulate
from divespot.simulate.shapes import ROWS

#: Relative standard deviation of a camera's scale, as `piles/budget.rs` has it.
SCALE = 0.0005
#: Frames of a hand: as many as three rails have.
HAND_FRAMES = 12


def one(number: int, density: float) -> tuple[float, float, str]:
    """Return the relative error and u95 of a round, and its largest terms."""
    name = list(ROWS)[number % len(ROWS)]
    path, count = ("hand", HAND_FRAMES) if number % 3 == 2 else ("rail", None)
    taken = simulate.frames(name, seed=number, density=density, path=path, count=count)  # type: ignore[arg-type]
    scale = 1.0 + SCALE * np.random.default_rng(number).standard_normal()
    depth = (taken.depth * (0.001 * scale)).astype(np.float32)
    pile = divespot.measure(frames.fuse(depth, taken.matrix)).piles[0]
    terms = {k: v / taken.volume_m3 for k, v in dataclasses.asdict(pile.budget).items()}
    largest = sorted(terms.items(), key=lambda term: -term[1])[:4]
    told = f"{name} {path:4}  " + "  ".join(f"{k[:-3]} {v:.3%}" for k, v in largest)
    return pile.volume_m3 / taken.volume_m3 - 1.0, pile.u95_m3 / taken.volume_m3, told


def main(rounds: int = 36, density: float = 0.2) -> None:
    """Print a line for each round, and what they come to."""
    found = []
    for number in range(rounds):
        error, u95, told = one(number, density)
        found.append((error, u95))
        print(f"{error:+8.3%} ± {u95:.3%}  {told}", flush=True)
    errors, u95s = np.array(found).T
    ratio = np.sqrt(np.mean((2.0 * errors / u95s) ** 2))
    held = np.mean(np.abs(errors) <= u95s)
    print(f"held {held:.1%} of {rounds}; errors are {ratio:.2f} standard uncertainties (rms)")


if __name__ == "__main__":
    main(*(kind(arg) for kind, arg in zip((int, float), sys.argv[1:], strict=False)))
