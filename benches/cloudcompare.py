"""The volume of a yard as users of CloudCompare have it: above a ground that they hand it.

Debian's CloudCompare reads no LAS: it gets the points, and the yard's true ground, as PLY, which is
written before the clock starts. It finds no piles and gives no uncertainty: one volume for all.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np

from yard import CORNER_M, DEPTH_M, SLOPE, WIDTH_M, heaps

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

#: Edge of its cells: divespot's, in the whole of a yard.
STEP_M = 0.25

COMMAND = f"""CloudCompare -SILENT -AUTO_SAVE OFF -O yard.ply -O ground.ply
-VOLUME -GRID_STEP {STEP_M}"""

HEADER = """ply
format binary_little_endian 1.0
element vertex {}
property float x
property float y
property float z
end_header
"""


def is_there() -> bool:
    """Return whether CloudCompare is installed."""
    return shutil.which("CloudCompare") is not None


def volume(path: Path) -> dict[str, Any]:
    """Return what CloudCompare says of a yard, and what it takes."""
    with tempfile.TemporaryDirectory() as folder, laspy.open(path) as reader:
        parts = (
            np.column_stack([points.x, points.y, points.z]) - CORNER_M
            for points in reader.chunk_iterator(1_000_000)
        )
        _write(Path(folder, "yard.ply"), reader.header.point_count, parts)
        ground = _ground()
        _write(Path(folder, "ground.ply"), len(ground), [ground])
        began = time.perf_counter()
        subprocess.run(
            COMMAND.split(),
            cwd=folder,
            env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        took_s = time.perf_counter() - began
        (told,) = Path(folder).glob("VolumeCalculationReport*.txt")
        (found,) = re.findall(r"^Volume: ([\d,.-]+)$", told.read_text(), re.MULTILINE)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    truth_m3 = sum(heap.volume_m3 for heap in heaps())
    return {
        "wall_s": took_s,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
        "total_off": float(found.replace(",", "")) / truth_m3 - 1.0,
    }


def _ground() -> NDArray[np.float64]:
    x, y = np.meshgrid(*(np.arange(0.5 * STEP_M, size_m, STEP_M) for size_m in (WIDTH_M, DEPTH_M)))
    return np.column_stack([x.ravel(), y.ravel(), SLOPE * x.ravel()])


def _write(path: Path, count: int, parts: Iterable[NDArray[np.float64]]) -> None:
    with path.open("wb") as stream:
        stream.write(HEADER.format(count).encode())
        for part in parts:
            stream.write(part.astype("<f4").tobytes())
