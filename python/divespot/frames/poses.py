"""Poses of frames: TUM, KITTI, or one 4 × 4 matrix per line; from each camera to one frame."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from divespot._arguments import as_floats, shown
from divespot.errors import DivespotError
from divespot.frames.text import text_of
from divespot.output import write_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

Poses: TypeAlias = "str | os.PathLike[str] | ArrayLike"

#: Largest deviation of a rotation matrix times its transpose from the identity.
SQUARE = 1e-3
#: Numbers per line in each format.
TUM, KITTI, MATRIX = 8, 12, 16
#: Largest difference in seconds between the times of a pose and a frame, as in TUM's tools.
NEAR_S = 0.02


def read_poses(
    path: str | os.PathLike[str], times_s: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Read poses, from each camera (x right, y down, z ahead) to a common frame.

    Parameters
    ----------
    path
        Lines of ``time x y z qx qy qz qw`` (TUM), of 12 numbers (KITTI: the upper three rows), or
        of 16 (4 × 4); lines that begin with ``#`` are skipped.
    times_s
        Times of the frames: for each, the pose nearest in time is taken from a TUM file; otherwise
        its lines are the frames in order.

    Returns
    -------
    poses
        Shape ``(n, 4, 4)``; NaN for a frame without a pose within 20 ms.

    Raises
    ------
    DivespotError
        The file cannot be read, or a line is not a pose.

    Examples
    --------
    >>> from pathlib import Path
    >>> path = Path("poses.txt")
    >>> _ = path.write_text("0.0 1.5 0 2 0 0 0 1")  # TUM: 1.5 m along x and 2 m along z
    >>> read_poses(path)[0, :3, 3].tolist()
    [1.5, 0.0, 2.0]

    """
    file = Path(os.fsdecode(path))
    lines = text_of(file, "lines of numbers are needed").splitlines()
    rows = [
        _row(file, number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows or len({len(row) for row in rows}) != 1:
        raise DivespotError(f"{file}: as many numbers on each line are needed: 8, 12 or 16")
    table = np.array(rows)
    poses = require_rigid(_matrices(table), str(file))
    if table.shape[1] == TUM and times_s is not None:
        return _at(table[:, 0], poses, np.asarray(times_s))
    return poses


def _row(file: Path, number: int, line: str) -> list[float]:
    try:
        row = [float(word) for word in line.replace(",", " ").split()]
    except ValueError:
        row = []
    if len(row) not in (TUM, KITTI, MATRIX) or not np.isfinite(row).all():
        raise DivespotError(
            f"{file}: line {number} is no pose: 8 numbers (TUM), 12 (KITTI) or 16 (4 x 4) are "
            "needed"
        )
    return row


def _matrices(table: NDArray[np.float64]) -> NDArray[np.float64]:
    poses = np.tile(np.eye(4), (len(table), 1, 1))
    if table.shape[1] != TUM:
        poses[:, :3] = table[:, :KITTI].reshape(-1, 3, 4)
        return poses
    poses[:, :3, 3] = table[:, 1:4]
    quaternions = table[:, 4:]
    with np.errstate(all="ignore"):
        x, y, z, w = (quaternions / np.sqrt((quaternions**2).sum(axis=1))[:, None]).T
    poses[:, :3, :3] = np.stack(
        [
            *(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            *(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            *(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        ],
        axis=1,
    ).reshape(-1, 3, 3)
    return poses


def _at(
    stamps_s: NDArray[np.float64], poses: NDArray[np.float64], times_s: NDArray[np.float64]
) -> NDArray[np.float64]:
    off_s = np.abs(stamps_s[None] - times_s[:, None])
    nearest = off_s.argmin(axis=1)
    found: NDArray[np.float64] = poses[nearest].copy()
    found[off_s[np.arange(len(times_s)), nearest] > NEAR_S] = np.nan
    return found


def require_rigid(poses: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """Raise DivespotError unless all poses are rigid motions."""
    turns = np.where(np.isfinite(poses[:, :3, :3]), poses[:, :3, :3], 0.0)
    off = np.abs(np.einsum("nij,nkj->nik", turns, turns) - np.eye(3)).max(axis=(1, 2))
    bad = np.flatnonzero(~((off < SQUARE) & (np.linalg.det(turns) > 0.0)))
    if len(bad):
        raise DivespotError(f"{name}: pose {bad[0] + 1} is no rigid motion: rotations are needed")
    return poses


def as_poses(
    given: Poses, count: int, times_s: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Return the poses of `count` frames from a file or an array ``(n, 4, 4)``."""
    if isinstance(given, str | os.PathLike):
        poses, name = read_poses(given, times_s), os.fsdecode(given)
    else:
        poses, name = as_floats("poses", given).astype(np.float64, copy=False), "poses"
        if poses.ndim != 3 or poses.shape[1:] != (4, 4):
            raise DivespotError(f"poses have shape {poses.shape}: shape (n, 4, 4) is needed")
        require_rigid(poses, name)
    if len(poses) != count:
        raise DivespotError(f"{name}: {len(poses)} poses for {count} frames: one each is needed")
    return poses


def write_poses(
    path: str | os.PathLike[str],
    poses: Sequence[NDArray[np.float64] | None],
    times_s: Sequence[float] | None = None,
) -> None:
    """Write poses in TUM's format: ``time x y z qx qy qz qw``.

    Frames that were left out have no line; without `times_s` the time is the frame's number.

    Examples
    --------
    >>> from pathlib import Path
    >>> import numpy as np
    >>> path = Path("poses.txt")
    >>> write_poses(path, [np.eye(4), None, np.eye(4)])  # the second frame was left out
    >>> [line.split()[0] for line in path.read_text().splitlines()[1:]]
    ['0.000000', '2.000000']

    """
    if not isinstance(poses, list | tuple | np.ndarray):
        raise DivespotError(f"poses are {shown(poses)}: a list of 4 x 4 matrices is needed")
    times = as_floats("times_s", np.arange(len(poses)) if times_s is None else times_s)
    if times.shape != (len(poses),):
        raise DivespotError(f"{times.size} times for {len(poses)} poses: one each is needed")
    kept = [at for at, pose in enumerate(poses) if pose is not None]
    placed = as_poses([poses[at] for at in kept], len(kept)) if kept else ()
    lines = ["# written by divespot: time x y z qx qy qz qw"]
    for at, pose in zip(kept, placed, strict=True):
        values = (*pose[:3, 3], *_quaternion(pose[:3, :3]))
        lines.append(" ".join([f"{times[at]:.6f}", *(f"{v:.9f}" for v in values)]))
    write_text(path, "\n".join(lines) + "\n")


def _quaternion(turn: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """Return x, y, z, w, computed in the most accurate of four ways (Shepperd 1978)."""
    (a, b, c), (d, e, f), (g, h, i) = turn.tolist()
    ways = [
        (1 + a - e - i, (1 + a - e - i, b + d, c + g, h - f)),
        (1 - a + e - i, (b + d, 1 - a + e - i, f + h, c - g)),
        (1 - a - e + i, (c + g, f + h, 1 - a - e + i, d - b)),
        (1 + a + e + i, (h - f, c - g, d - b, 1 + a + e + i)),
    ]
    square, values = max(ways)
    x, y, z, w = (0.5 * v / square**0.5 for v in values)
    return x, y, z, w
