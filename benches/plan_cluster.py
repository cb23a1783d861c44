"""What a cluster takes for many points: a simulation of its reads and of the tree of its merges."""

from __future__ import annotations

import argparse
import heapq
from dataclasses import dataclass

from divespot.one_pass import MOST_VOXELS
from divespot.scale.cluster import MERGED, TASK_POINTS

#: Points in each voxel of a task, fewest: of a survey with more voxels than are held, they double.
POINTS_A_VOXEL = 25.0

#: Bytes a second between two machines and from a store of files, and what an hour of a core costs.
NETWORK_BYTES_S, STORE_BYTES_S, DOLLARS_A_CORE_H = 125e6, 50e6, 0.04

#: Seconds that Dask's scheduler takes for a task (its documentation: below a millisecond).
SCHEDULER_S = 1e-3


@dataclass(frozen=True)
class Figures:
    """What was measured: points a second and core, merging a voxel, bytes."""

    points_a_s: float = 3.0e6
    merge_s: float = 2e-7
    voxel_bytes: float = 34.5
    file_bytes: float = 3.0


def simulated(points: float, workers: int, figures: Figures) -> tuple[float, float, int]:
    """Return seconds until all is merged, bytes sent, and tasks."""
    tasks = max(1, round(points / TASK_POINTS))
    read_s = TASK_POINTS * max(1.0 / figures.points_a_s, figures.file_bytes / STORE_BYTES_S)
    free = [0.0] * workers
    ends = []
    for number in range(tasks):
        start = max(heapq.heappop(free), number * SCHEDULER_S)
        ends.append(start + read_s)
        heapq.heappush(free, start + read_s)
    level = [(end, TASK_POINTS / POINTS_A_VOXEL) for end in ends]
    sent = 0.0
    while len(level) > 1:
        groups = [level[first : first + MERGED] for first in range(0, len(level), MERGED)]
        merged = []
        for group in sorted(groups, key=lambda parts: max(end for end, _ in parts)):
            voxels = sum(held for _, held in group)
            moved = voxels * figures.voxel_bytes * (len(group) - 1) / len(group)
            start = max(*(end for end, _ in group), heapq.heappop(free))
            end = start + voxels * figures.merge_s + moved / NETWORK_BYTES_S
            heapq.heappush(free, end)
            merged.append((end, min(voxels, MOST_VOXELS)))
            sent += moved
        level = merged
    return level[0][0], sent, tasks


def print_plan(points: float, figures: Figures) -> None:
    """Print a line for each number of workers."""
    print(f"\n{points:.0e} points, {figures.points_a_s / 1e6:.2f} M points a second and core:")
    print(f"{'workers':>8} {'min':>8} {'tasks':>7} {'sent GB':>8} {'core h':>7} {'dollars':>8}")
    for workers in (1, 10, 100, 1000):
        seconds, sent, tasks = simulated(points, workers, figures)
        hours = seconds * workers / 3600.0
        print(
            f"{workers:8} {seconds / 60.0:8.1f} {tasks:7} {sent / 1e9:8.1f} {hours:7.1f} "
            f"{hours * DOLLARS_A_CORE_H:8.2f}"
        )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("points", nargs="?", type=float, default=1e11)
    parser.add_argument("--points-a-s", type=float, default=Figures.points_a_s)
    given = parser.parse_args()
    print_plan(given.points, Figures(points_a_s=given.points_a_s))
