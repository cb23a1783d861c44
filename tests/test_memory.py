"""Too little memory is a MemoryError, never the end of the process."""

from __future__ import annotations

import subprocess
import sys
import weakref
from typing import Any

import pytest

import divespot
from divespot import pipeline, simulate, surface

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="needs /proc and RLIMIT_AS")

LIMITED = """
import resource, sys
import numpy as np
import divespot
rng = np.random.default_rng(0)
points = rng.uniform(0.0, 30.0, (300_000, 3)) * (1.0, 1.0, 0.001)
kernels = {
    "fit_plane": lambda: divespot.fit_plane(points, 0.01, threads=1),
    "hdbscan": lambda: divespot.hdbscan(points, threads=1),
    "height_map": lambda: divespot.height_map(points, 0.02),
    "height_map of triangles": lambda: divespot.height_map(points, 0.1, triangulated=True),
    "measure": lambda: divespot.measure(points, threads=1),
    "min_samples": lambda: divespot.hdbscan(points, min_samples=299_000, threads=1),
    "radius_outlier_mask": lambda: divespot.radius_outlier_mask(points, 0.1, 3, threads=1),
    "survey": lambda: divespot.survey(points, threads=1),
    "voxel_downsample": lambda: divespot.voxel_downsample(points, 1e-4, threads=1),
}
held = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
most = held + (int(sys.argv[2]) << 20)
resource.setrlimit(resource.RLIMIT_AS, (most, most))
try:
    kernels[sys.argv[1]]()
except MemoryError as error:
    print(f"MemoryError: {error}")
else:
    print("done")
"""


@pytest.mark.parametrize("megabytes", [15, 40])
@pytest.mark.parametrize(
    "name",
    [
        "fit_plane",
        "hdbscan",
        "height_map",
        "height_map of triangles",
        "measure",
        "min_samples",
        "radius_outlier_mask",
        "survey",
        "voxel_downsample",
    ],
)
def test_too_little_memory_is_an_error(name: str, megabytes: int) -> None:
    command = [sys.executable, "-W", "ignore", "-c", LIMITED, name, str(megabytes)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith(("MemoryError: ", "done"))
    if megabytes == 15:
        assert ended.stdout.startswith("MemoryError: there is no memory for ")


@pytest.mark.skipif(sys.version_info < (3, 11), reason="there, callers hold what they passed")
def test_points_are_freed_once_they_have_been_used(monkeypatch: pytest.MonkeyPatch) -> None:
    held: list[weakref.ref[Any]] = []
    find_surface = surface.find_surface

    def watched(*given: Any) -> Any:  # noqa: ANN401 - as find_surface
        found = find_surface(*given)
        held.append(weakref.ref(found.points))
        return found

    monkeypatch.setattr(pipeline, "find_surface", watched)
    alive: dict[str, bool] = {}
    points = simulate.scan("shape-05", density=0.03).points
    divespot.measure(
        points, on_stage=lambda stage: alive.update({stage: any(ref() is not None for ref in held)})
    )
    assert alive["volume"]
    assert not alive["holes"]
