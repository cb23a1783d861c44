"""How long until Ctrl-C ends: ``python tests/interrupt.py [POINTS]``, or `make interrupt`.

Every stage of `divespot.measure` and every kernel gets SIGINT a few times while it runs; a table
tells how long it takes, of the kernels 20 s at most, and the longest time until
`KeyboardInterrupt`. Stages that take less than `SHORT_S` are left out.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

import numpy as np

import divespot
from divespot import _native

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

#: Goal of the time until Ctrl-C ends, in seconds.
MOST_S = 0.5

#: What is done sooner than this need not be interrupted.
SHORT_S = 0.2

#: A call that takes longer is interrupted then.
LONG_S = 20.0

#: Parts of a stage's time after which it is interrupted.
WHEN = (0.2, 0.5, 0.8)


def heap(count: int) -> NDArray[np.float64]:
    """Return a noisy cone on a floor, 30 m wide."""
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 30.0, (count, 3))
    radius = np.hypot(points[:, 0] - 15.0, points[:, 1] - 15.0)
    points[:, 2] = np.maximum(0.0, 6.0 - 0.6 * radius) + rng.normal(0.0, 0.002, count)
    return points


def kernels(points: NDArray[np.float64]) -> dict[str, Callable[[], Any]]:
    """Return calls of every public kernel, some of which would take hours."""
    grid = divespot.height_map(points[::10], 0.05)
    corners = np.column_stack([f(np.linspace(0.0, 6.28, 100_000)) for f in (np.cos, np.sin)])
    return {
        "fit_plane": lambda: divespot.fit_plane(points, 1e-9, hypotheses=2**31),
        "ground_height": lambda: divespot.ground_height(points[:, 2], bin_m=1e-6),
        "hdbscan": lambda: divespot.hdbscan(points, min_samples=50),
        "height_histogram": lambda: divespot.height_histogram(points[:, 2], bin_m=1e-6),
        "height_map": lambda: divespot.height_map(points, 0.01),
        "height_map of triangles": lambda: divespot.height_map(points, 0.01, triangulated=True),
        "integrate": lambda: divespot.integrate(grid.heights_m, 0.05),
        "point_spacing": lambda: divespot.point_spacing(points.round(1)),
        "radius_outlier_mask": lambda: divespot.radius_outlier_mask(points, 3.0, 10**6),
        "survey": lambda: divespot.survey(points),
        "voxel_downsample": lambda: divespot.voxel_downsample(points, 1e-4),
        "inside": lambda: _native.inside([corners], points[:, :2].copy()),
        "hills": lambda: _native.hills(grid.heights_m, 0.05, with_holes=True, threads=0),
    }


class Interrupter:
    """Sends SIGINT a while after it is asked to, unless it is called off."""

    def __init__(self) -> None:
        self.sent = 0.0
        self._timer: threading.Timer | None = None

    def after(self, seconds: float) -> None:
        self._timer = threading.Timer(seconds, self._send)
        self._timer.start()

    def call_off(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer.join()

    def _send(self) -> None:
        self.sent = time.monotonic()
        os.kill(os.getpid(), signal.SIGINT)


def until_ended(call: Callable[[Interrupter], object]) -> float:
    """Return the seconds from SIGINT to its exception; NaN where the call ended before."""
    interrupter = Interrupter()
    try:
        call(interrupter)
        interrupter.call_off()
    except KeyboardInterrupt:
        return time.monotonic() - interrupter.sent
    return float("nan")


def worst_of_call(call: Callable[[], object]) -> tuple[float, float]:
    """Return how long a call takes, up to some seconds, and the longest until it ended."""

    def interrupted(interrupter: Interrupter, seconds: float) -> None:
        interrupter.after(seconds)
        call()

    begin = time.monotonic()
    first = until_ended(lambda i: interrupted(i, LONG_S))
    whole = time.monotonic() - begin
    ends = [until_ended(lambda i, p=part: interrupted(i, p * whole)) for part in WHEN]  # type: ignore[misc]
    return whole, float(np.nanmax([0.0, first, *ends]))


def stages(points: NDArray[np.float64]) -> dict[str, float]:
    """Return the seconds of each stage."""
    return dict(divespot.measure(points).timings_s)


def worst_of_stage(points: NDArray[np.float64], name: str, seconds: float) -> float:
    """Return the longest time until a stage ended."""

    def measure(interrupter: Interrupter, after: float) -> None:
        def begun(stage: str) -> None:
            if stage == name:
                interrupter.after(after)

        divespot.measure(points, on_stage=begun)

    ends = [until_ended(lambda i, p=part: measure(i, p * seconds)) for part in WHEN]  # type: ignore[misc]
    return float(np.nanmax([0.0, *ends]))


def main(count: int) -> int:
    """Print the table; return 1 where something took longer than it may."""
    points, worst = heap(count), 0.0
    for name, call in kernels(points).items():
        whole, ended = worst_of_call(call)
        worst = max(worst, ended)
        sys.stdout.write(f"{name:26s} {whole:8.2f} s {ended:8.2f} s\n")
        sys.stdout.flush()
    for name, seconds in stages(points).items():
        if seconds < SHORT_S:
            continue
        ended = worst_of_stage(points, name, seconds)
        worst = max(worst, ended)
        sys.stdout.write(f"measure: {name:17s} {seconds:8.2f} s {ended:8.2f} s\n")
        sys.stdout.flush()
    sys.stdout.write(f"{count:,} points, the longest until Ctrl-C ended: {worst:.2f} s\n")
    return int(worst > MOST_S)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000))
