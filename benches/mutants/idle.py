"""Constants that decide no answer: twice or half of them changes no bit of any."""

from __future__ import annotations

import fnmatch
import importlib
import subprocess
import sys
from pathlib import Path

import numpy as np

import divespot
from divespot import simulate

#: How work is shared out, what is polled how often, sizes of trees' leaves and of tables.
IDLE = (
    *("*.rs CHUNK", "*.rs LEAF", "*.rs BLOCK", "cancel.rs EVERY", "simple_polygon.rs POLLED"),
    *("dealt.rs DENSE", "dealt.rs BLOCKS", "dealt.rs FEWEST", "dealt.rs MOST_COLUMNS"),
    *("frames/edges.rs ROWS", "hdbscan/knn.rs *", "hdbscan/tree.rs SAMPLE", "heightmap.rs PARTS"),
    *("heightmap.rs BYTES_A_CELL", "lzf.rs PIECE", "nearest.rs DRAWN", "neighbors.rs FEW"),
    *("neighbors.rs MARGIN", "voxel/dense.rs MOST_WORDS", "voxel/lattice.rs MOST_CELLS"),
    *("io.las _BATCH_BYTES", "io.las_stretches STRETCH", "io.table _ROWS_AT_ONCE"),
    *("selection BLOCK",),
    *("results.document _BLOCK", "results.las_points BATCH", "results.sideways TOGETHER"),
    *("io.web GAP_BYTES", "io.web HEAD_BYTES"),
)
#: Not so, though they are called the same.
DECIDING = ("surface/columns.rs BLOCK", "hdbscan/knn.rs BEYOND", "hdbscan/knn.rs BYTES_A_NEIGHBOR")
#: How finely something is computed: twice as finely is right too. Half must be noticed.
FINE = (
    *("harmonic.rs SWEEPS", "ground.rs COMPARED", "piles/banks.rs PARTS", "piles/base.rs ROUNDS"),
    *(
        "piles/breakline.rs ROUNDS",
        "piles/breakline.rs SETTLINGS",
        "piles/flat_top.rs FITS",
        "plane.rs LEAST_HYPOTHESES",
    ),
    *("plane.rs REFITS", "plane.rs SCORED", "tin.rs PLACES"),
)
#: Numbers of things, no quantities; and what stands for infinity.
NO_QUANTITY = (
    *("connectivity.rs *", "moments.rs PAIRS", "piles/outline.rs STEPS", "piles/region.rs OTHERS"),
    *("piles/kriging.rs UNKNOWN", "frames/joint.rs HELD", "pose.rs PARALLEL", "sensor SMALLEST"),
    *("io.crs *", "io.las _COMPRESSED_BIT", "io.packed _GZIP_BITS", "io.mesh _GLB_HEAD"),
)


def is_any(name: str, patterns: tuple[str, ...]) -> bool:
    """Whether a constant is one of those."""
    return any(fnmatch.fnmatch(name, pattern) for pattern in patterns)


def decides(name: str) -> bool:
    """Whether a constant may decide an answer."""
    return not is_any(name, IDLE) or is_any(name, DECIDING)


def signs(name: str) -> str:
    """Return what is tried of a constant: twice as much, half as much."""
    return "" if is_any(name, NO_QUANTITY) else "/" if is_any(name, FINE) else "*/"


def answers(copy: Path, environment: dict[str, str]) -> str:
    """Return hashes of what a process with this environment answers to some scans."""
    command = [sys.executable, __file__, str(copy)]
    run = subprocess.run(
        command, cwd=copy, env=environment, capture_output=True, text=True, check=False
    )
    return run.stdout + ("" if run.returncode == 0 else run.stderr)


def changed(mutants: dict[str, str], copy: Path, environment: dict[str, str]) -> list[str]:
    """Return those of the mutants with which an answer changes; say which no answer reads."""
    if not mutants:
        return []
    read = copy.parent / "read-by-answers"
    read.unlink(missing_ok=True)
    same = answers(copy, environment | {"DIVESPOT_READ": str(read)})
    known = set(read.read_text().split("\n"))
    unread = [name for name, chosen in mutants.items() if chosen[1:] not in known]
    print(*(f"read by none of the answers: {name}" for name in unread), sep="\n")
    tried = {name: chosen for name, chosen in mutants.items() if name not in unread}
    return [
        m
        for m, chosen in tried.items()
        if answers(copy, environment | {"DIVESPOT_MUTANT": chosen}) != same
    ]


def main(copy: Path) -> None:
    """Print a hash of each stage of a few scans, and of the kernels' answers."""
    sys.path.append(str(copy / "packaging"))
    stages = importlib.import_module("stages")

    for name in ("shape-05", "over-bars", "bay"):
        path = copy.parent / f"{name}.npy"
        if not path.exists():
            np.save(path, simulate.scan(name, density=0.03).points)
        stages.main([str(path)])
    points = np.random.default_rng(1).normal(size=(30_000, 3))
    print(stages.digest(divespot.hdbscan(points[:8000], min_cluster_size=20)))
    print(stages.digest(divespot.radius_outlier_mask(points, 0.1, 4)))
    print(stages.digest(divespot.voxel_downsample(points, 0.05)))
    print(stages.digest(divespot.point_spacing(points)))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
