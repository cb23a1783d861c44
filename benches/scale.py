"""Scans of any size: `python benches/scale.py [POINTS...] [--folder FOLDER]`.

Writes the stockyard of `yard.py` as LAZ, by default of 10⁷ points (10⁸ take some minutes), and
prints for each: time, processor time and peak memory of bare decoding, of one process, of one in
cells of a metre, of two workers of a Dask cluster and, up to 2·10⁷ points, of laspy and
`divespot.measure` with the whole file in memory, and of CloudCompare; what merging costs; the
errors of the forty volumes; and between the two largest files the exponent of growth. Each way
runs in a process of its own. With `--plan POINTS` it prints what a cluster would take, by these
figures.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np

import cloudcompare
import divespot.streaming
import divespot.too_large
from divespot.io.las_stretches import records_of
from divespot.scale import measure
from divespot.settings import Settings
from plan_cluster import Figures, print_plan
from yard import CORNER_M, heaps, write_yard

if TYPE_CHECKING:
    from collections.abc import Callable

    from divespot import Report

#: Points that are decoded at a time where nothing else is done: several chunks for each thread.
DECODED = 1_000_000

#: Largest file that is held in memory whole: 120 bytes a point.
MOST_WHOLE = 20_000_000

#: What holds it.
HELD = ("laspy, whole file", "CloudCompare, PLY")

#: Tasks whose parts are merged one by one.
MERGED = 8


def decode(path: Path) -> dict[str, Any]:
    """Decode what divespot reads of each point, on all cores, and nothing else."""
    parts = laspy.DecompressionSelection
    selection = parts.base() | parts.Z | parts.CLASSIFICATION | parts.FLAGS
    backend = laspy.LazBackend.LazrsParallel
    with laspy.open(path, laz_backend=backend, decompression_selection=selection) as reader:
        return {"points": sum(len(points) for points in reader.chunk_iterator(DECODED))}


def one_process(path: Path) -> dict[str, Any]:
    """Measure in one pass, whatever the size."""
    divespot.too_large.MOST_HELD = 0
    used: dict[str, float] = {}
    report = divespot.measure(path, on_stage=lambda stage: used.update({stage: processor_s()}))
    return judged(report) | {"read_cpu_s": used["crop"] - used["read"]}


def metre_cells(path: Path) -> dict[str, Any]:
    """Measure in cells as wide as two coarse voxels of these yards: no windows are needed."""
    divespot.too_large.MOST_HELD = 0
    return judged(divespot.measure(path, cell_m=1.0))


def two_workers(path: Path) -> dict[str, Any]:
    """Measure by two workers, started before the clock is."""
    import distributed  # noqa: PLC0415 - an extra

    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        began = time.perf_counter()
        report = measure(path, client)
        took = time.perf_counter() - began
        peaks = client.run(lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return judged(report) | {"wall_s": took, "worker_mb": max(peaks.values()) / 1024}


def whole_file(path: Path) -> dict[str, Any]:
    """Measure as users do who have laspy and an array."""
    points = laspy.read(path).xyz
    return judged(divespot.measure(np.ascontiguousarray(points)))


def merging(path: Path) -> dict[str, Any]:
    """Time merging and packing the parts of some tasks."""
    plan = divespot.streaming.planned([str(path)], Settings())
    parts = []
    for stretches in np.array_split(np.array(plan.stretches, dtype=object), MERGED):
        part = plan.way.nothing()
        for stretch in stretches[:: max(1, len(stretches) // 10)]:
            plan.way.take(records_of(stretch), stretch.layout, part)
        parts.append(part)
    voxels = sum(part.voxels.voxels for part in parts)
    began = time.perf_counter()
    packed = [part.voxels.to_bytes() for part in parts]
    packing_s = time.perf_counter() - began
    began = time.perf_counter()
    total = plan.way.nothing()
    for part in parts:
        total.merge(part)
    merge_s = time.perf_counter() - began
    return {
        "bytes_a_voxel": sum(map(len, packed)) / voxels,
        "merge_ns": 1e9 * merge_s / voxels,
        "pack_ns": 1e9 * packing_s / voxels,
    }


WAYS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "bare decoding": decode,
    "one process": one_process,
    "cells of 1 m": metre_cells,
    "two workers": two_workers,
    "laspy, whole file": whole_file,
    "CloudCompare, PLY": cloudcompare.volume,
    "merging": merging,
}


def judged(report: Report) -> dict[str, Any]:
    """Hold the piles of a report against the yard's."""
    errors, inside = [], 0
    for heap in heaps():
        at = np.array(heap.at_m) + CORNER_M[:2]
        pile = min(report.piles, key=lambda p: math.dist(p.centroid_m[:2], at))
        errors.append(abs(pile.volume_m3 / heap.volume_m3 - 1.0))
        inside += abs(pile.volume_m3 - heap.volume_m3) < pile.u95_m3
    bits = [(pile.volume_m3, pile.u95_m3) for pile in report.piles]
    return {"piles": len(report.piles), "worst": max(errors), "inside": inside, "bits": repr(bits)}


def ran(way: str, path: Path) -> dict[str, Any]:
    """Run one way in a process of its own."""
    command = [sys.executable, __file__, "--run", way, str(path)]
    ended = subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE)
    found: dict[str, Any] = json.loads(ended.stdout.splitlines()[-1])
    return found


def run(way: str, path: Path) -> None:
    """Print what one way takes, as JSON."""
    began, used = time.perf_counter(), processor_s()
    found = WAYS[way](path)
    found.setdefault("wall_s", time.perf_counter() - began)
    found.setdefault("cpu_s", processor_s() - used)
    found.setdefault("peak_mb", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(json.dumps(found))


def processor_s() -> float:
    """Return seconds of all cores that this process and those it waited for took."""
    both = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in both)


def print_file(path: Path, points: int) -> dict[str, Any]:
    """Run all ways on a file and print a line each."""
    print(f"\n{points} points, {path.stat().st_size / points:.2f} bytes a point")
    print(f"{'':18} {'s':>8} {'CPU s':>8} {'MB':>6} {'M points/s':>10} {'/ bare':>7} {'CPU':>6}")
    results: dict[str, Any] = {}
    for way in WAYS:
        if way == "merging" or (way in HELD and points > MOST_WHOLE):
            continue
        if way.startswith("CloudCompare") and not cloudcompare.is_there():
            print("CloudCompare is not installed")
            continue
        found = results[way] = ran(way, path)
        bare = results["bare decoding"]
        print(
            f"{way:18} {found['wall_s']:8.2f} {found['cpu_s']:8.2f} {found['peak_mb']:6.0f} "
            f"{points / found['wall_s'] / 1e6:10.2f} {bare['wall_s'] / found['wall_s']:7.2f} "
            f"{bare['cpu_s'] / found['cpu_s']:6.2f}"
            + (f"  (each worker {found['worker_mb']:.0f} MB)" if "worker_mb" in found else "")
        )
        if "total_off" in found:
            print(f"{'':18} one volume for all, {found['total_off']:+.3%} off")
        if "worst" in found:
            print(
                f"{'':18} {found['piles']} piles, largest error {found['worst']:.3%}, "
                f"{found['inside']} inside u95"
            )
    same = results["one process"]["bits"] == results["two workers"]["bits"]
    print(f"one process and two workers give the same bits: {'yes' if same else 'NO'}")
    return results


def main() -> None:
    """Write the yards, measure them, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("points", nargs="*", type=float, default=[1e7])
    parser.add_argument("--folder", type=Path, help="where the yards are kept")
    parser.add_argument("--plan", type=float, default=1e11, help="points that a cluster is for")
    parser.add_argument("--run", nargs=2, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.run:
        run(given.run[0], Path(given.run[1]))
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = given.folder or Path(temporary)
        found = {}
        for number in sorted(map(int, given.points)):
            path = folder / f"yard-{number}.laz"
            if not path.exists():
                write_yard(path, number)
            with laspy.open(path) as reader:
                points = reader.header.point_count
            found[points] = print_file(path, points)
        merged = ran("merging", path)
    print(
        f"\nmerging: {merged['merge_ns']:.0f} ns and {merged['bytes_a_voxel']:.1f} bytes a voxel, "
        f"packing {merged['pack_ns']:.0f} ns"
    )
    if len(found) > 1:
        print_growth(found)
    if importlib.util.find_spec("pdal") is None:
        print("PDAL was not measured: Debian 12 has no package of it, PyPI no wheel")
    one, last = found[points]["one process"], points
    print_plan(
        given.plan,
        Figures(
            points_a_s=last / one["read_cpu_s"],
            merge_s=1e-9 * (merged["merge_ns"] + 2 * merged["pack_ns"]),
            voxel_bytes=merged["bytes_a_voxel"],
            file_bytes=path_bytes(given.folder, last),
        ),
    )


def path_bytes(folder: Path | None, points: int) -> float:
    """Return bytes a point of a yard, about, where it is kept."""
    sizes = [file.stat().st_size for file in folder.glob("yard-*.laz")] if folder else []
    return max(sizes) / points if sizes else 3.0


def print_growth(found: dict[int, dict[str, Any]]) -> None:
    """Print how time grows between the two largest files."""
    small, large = sorted(found)[-2:]
    for way in ("bare decoding", "one process", "cells of 1 m", "two workers"):
        for clock in ("wall_s", "cpu_s"):
            times = found[large][way][clock] / found[small][way][clock]
            exponent = math.log(times) / math.log(large / small)
            print(f"growth of {way}, {clock}: x {times:.2f}, exponent {exponent:.3f}")


if __name__ == "__main__":
    main()
