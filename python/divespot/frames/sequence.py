"""A sequence of depth frames as a folder of images, intrinsics and poses."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from divespot.errors import DivespotError, unwritable
from divespot.extras import is_installed
from divespot.frames.poses import write_poses
from divespot.frames.source import write_png
from divespot.output import whole, write_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Patterns of the files that `write_frames` writes.
OWN = re.compile(r"depth|depth\.npz|intrinsics\.json|poses\.txt")


def require_free(folder: str | os.PathLike[str], *, force: bool) -> None:
    """Raise DivespotError if a folder is not empty, or with `force` holds anything but frames."""
    path = Path(os.fsdecode(folder))
    try:
        held = [one.name for one in path.iterdir()] if path.exists() else []
    except OSError as error:
        raise unwritable(path, error) from None
    if held and not (force and all(OWN.fullmatch(name) for name in held)):
        raise DivespotError(f"{path}: is not empty: another folder, or --force, is needed")


def write_frames(
    folder: str | os.PathLike[str],
    depth: NDArray[np.uint16],
    matrix: NDArray[np.float64],
    poses: NDArray[np.float64],
) -> str:
    """Write depth in millimetres, intrinsics in Open3D's format, and poses in TUM's.

    Returns
    -------
    kind
        ``"PNG"``, or ``"NPZ"`` if Pillow is not installed.

    """
    path = Path(os.fsdecode(folder))
    try:
        images = path / "depth"
        is_png = is_installed("PIL.Image")
        (images if is_png else path).mkdir(parents=True, exist_ok=True)
        for old in images.glob("[0-9]*.png"):
            old.unlink()
        if is_png:
            for number, frame in enumerate(depth):
                write_png(images / f"{number:06d}.png", frame)
        else:
            with whole(path / "depth.npz") as stream:
                np.savez_compressed(stream, depth=depth)
    except OSError as error:
        raise unwritable(path, error) from None
    rows, columns = depth.shape[1:]
    known = {"width": columns, "height": rows, "intrinsic_matrix": matrix.T.ravel().tolist()}
    write_text(path / "intrinsics.json", json.dumps(known, indent=1) + "\n")
    write_poses(path / "poses.txt", list(poses))
    return "PNG" if is_png else "NPZ"
