"""Sequences of clouds put together: organised or not, of a camera or a laser scanner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, io, simulate
from divespot.cli import main
from divespot.frames import Intrinsics, fuse

if TYPE_CHECKING:
    from pathlib import Path

    from divespot.io import Scan
    from divespot.simulate import SimulatedFrames

#: From a camera's axes (z ahead) to those of a laser scanner (x ahead, z up).
LASER = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


@pytest.fixture(scope="module")
def rail() -> SimulatedFrames:
    return simulate.frames("shape-05", density=0.12)


def clouds(taken: SimulatedFrames) -> list[np.ndarray]:
    """Return the points of each frame, pixel by pixel, NaN where nothing was seen."""
    rows, columns = taken.depth.shape[1:]
    rays = Intrinsics.of(taken.matrix).rays(rows, columns)
    depth_m = np.where(taken.depth > 0, taken.depth * 0.001, np.nan)
    return [rays / rays[:, 2:] * one.reshape(-1, 1) for one in depth_m]


def organised(path: Path, points: np.ndarray, rows: int) -> None:
    """Write a PCD file with rows and columns."""
    head = (
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points) // rows}\nHEIGHT {rows}\nPOINTS {len(points)}\nDATA binary\n"
    )
    path.write_bytes(head.encode() + points.astype(np.float32).tobytes())


def scattered(path: Path, points: np.ndarray, seed: int) -> None:
    seen = points[np.isfinite(points[:, 0])]
    io.write(path, seen[np.random.default_rng(seed).permutation(len(seen))])


def holds(scan: Scan, taken: SimulatedFrames) -> None:
    (pile,) = divespot.measure(scan).piles
    assert abs(pile.volume_m3 - taken.volume_m3) < pile.u95_m3
    assert pile.u95_m3 < 0.01 * taken.volume_m3
    assert scan.registration is not None
    assert scan.registration.frames == 4


def test_organised_clouds_give_what_their_depth_images_do(
    rail: SimulatedFrames, tmp_path: Path
) -> None:
    for number, points in enumerate(clouds(rail)):
        organised(tmp_path / f"{number}.pcd", points, rail.depth.shape[1])
    scan = fuse(tmp_path)
    holds(scan, rail)
    assert scan.format == "clouds"
    of_images = fuse(rail.depth, rail.matrix)
    assert len(scan.points) == pytest.approx(len(of_images.points), rel=0.25)
    out = tmp_path / "scan.ply"
    done = CliRunner().invoke(main, ["fuse", str(tmp_path), "--output", str(out)])
    assert done.exit_code == 0, done.output
    assert np.allclose(io.read(out).points, scan.points, atol=1e-5)


def test_scattered_clouds_of_a_laser_scanner(rail: SimulatedFrames, tmp_path: Path) -> None:
    for number, points in enumerate(clouds(rail)):
        scattered(tmp_path / f"{number}.ply", points @ LASER.T, number)
    scan = fuse([tmp_path / f"{number}.ply" for number in range(4)])
    holds(scan, rail)
    again = fuse([tmp_path / f"{number}.ply" for number in range(4)], threads=1)
    assert again.points.tobytes() == scan.points.tobytes()


def test_poses_of_clouds_are_in_the_axes_of_the_clouds(
    rail: SimulatedFrames, tmp_path: Path
) -> None:
    for number, points in enumerate(clouds(rail)):
        scattered(tmp_path / f"{number}.ply", points @ LASER.T, number)
    poses = rail.poses.copy()
    poses[:, :3, :3] = poses[:, :3, :3] @ LASER.T
    holds(fuse(tmp_path, poses=poses, exact_poses=True), rail)


def test_what_is_no_sequence_of_clouds_is_refused(rail: SimulatedFrames, tmp_path: Path) -> None:
    scattered(tmp_path / "0.ply", clouds(rail)[0], 0)
    with pytest.raises(DivespotError, match="images are needed for those"):
        fuse(tmp_path, rail.matrix)
    with pytest.raises(DivespotError, match="images are needed for those"):
        fuse(tmp_path, depth_scale=0.001)
    (tmp_path / "1.las").write_bytes(b"LASF")
    with pytest.raises(DivespotError, match=r"a sequence of \.pcd or \.ply only"):
        fuse([tmp_path / "0.ply", tmp_path / "1.las"])
    io.write(tmp_path / "2.ply", np.eye(3))
    with pytest.raises(DivespotError, match="3 points"):
        fuse([tmp_path / "2.ply"])
