"""Depth frames from arrays, files of arrays, folders and lists of images."""

from __future__ import annotations

import os
import re
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias
from zipfile import BadZipFile

import numpy as np

from divespot._arguments import as_floats, number
from divespot.errors import DivespotError, unreadable
from divespot.extras import extra
from divespot.frames.bag import read_bag
from divespot.frames.mkv import read_mkv
from divespot.frames.recording import BAGS, VIDEOS, is_bag, is_recording, is_video

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import ArrayLike, NDArray

    from divespot.frames.intrinsics import Intrinsics
    from divespot.frames.recording import Recording

Depth: TypeAlias = "str | os.PathLike[str] | Sequence[str | os.PathLike[str]] | ArrayLike"

IMAGES = (".png", ".tif", ".tiff")
ARRAYS = (".npy", ".npz")
CLOUDS = (".pcd", ".ply")
OTHER_CLOUDS = (".las", ".laz", ".e57", ".xyz")
#: Metres per unit of integer depth: all common depth cameras write millimetres.
STEP_M = 0.001
#: Value that some cameras write, besides 0, for pixels without depth.
UNSEEN = 65_535
#: Most pixels of an image: four times those of any depth camera.
MOST_PIXELS = 1 << 24


@dataclass(frozen=True, eq=False)
class Frames:
    """Depth frames, read one at a time.

    Attributes
    ----------
    items
        An image or array per frame, or a recording.
    names
        The name of each frame.
    step_m
        Metres per unit of depth; None: a millimetre for integers, a metre for floats.
    times_s
        Time of each frame, if given by the names or the recording.
    path
        The file or folder that was given, or the first of several.
    intrinsics
        The camera's intrinsics from a recording, or why there are none.
    is_clouds
        Whether the frames are clouds, without pixels.

    """

    items: Sequence[Path | NDArray[Any]] | Recording
    names: tuple[str, ...]
    step_m: float | None = None
    times_s: tuple[float, ...] | None = None
    path: str | None = None
    intrinsics: Intrinsics | str = "no intrinsics were given"
    is_clouds: bool = False

    @classmethod
    def of(cls, depth: Depth, step_m: float | None = None, topic: str | None = None) -> Frames:
        """Return the frames of any accepted input; for a ROS recording, those of one topic.

        Raises
        ------
        DivespotError
            There are no frames, or they cannot be read.

        """
        if step_m is not None and not 0.0 < number("depth_scale", step_m) < 1e3:
            raise DivespotError(f"depth_scale is {step_m}: metres in a unit, above 0, are needed")
        path = Path(os.fsdecode(depth)) if isinstance(depth, str | os.PathLike) else None
        if topic is not None and (path is None or not is_bag(path)):
            raise DivespotError(
                f"depth_topic is {topic!r}: a recording of ROS, which has topics, is needed"
            )
        if path is not None:
            return replace(cls._of_path(path, step_m, topic), path=str(path))
        is_list = isinstance(depth, list | tuple) and len(depth) > 0
        if is_list and all(isinstance(one, str | os.PathLike) for one in depth):  # type: ignore[union-attr]
            return cls._of_files([Path(os.fsdecode(one)) for one in depth], step_m)  # type: ignore[union-attr,arg-type]
        array = as_floats("depth", depth) if is_list else np.asarray(depth)  # type: ignore[arg-type]
        return cls._of_array(array, "frame", step_m)

    @classmethod
    def _of_path(cls, path: Path, step_m: float | None, topic: str | None = None) -> Frames:
        if is_bag(path):
            return cls._of_recording(read_bag(path, topic), step_m)
        if is_video(path):
            return cls._of_recording(read_mkv(path), step_m)
        if os.path.isdir(path):  # noqa: PTH112 - False also for an invalid name
            inner = path / "depth"  # as in the folders of TUM's and Open3D's tools
            return cls._of_files(_in_order(inner if inner.is_dir() else path), step_m)
        return cls._of_files([path], step_m)

    @classmethod
    def _of_recording(cls, found: Recording, step_m: float | None) -> Frames:
        names = tuple(f"{found.path} frame {number}" for number in range(1, len(found) + 1))
        step_m = found.step_m if step_m is None else step_m
        return cls(found, names, step_m, found.times_s, str(found.path), found.intrinsics)

    @classmethod
    def _of_files(cls, files: list[Path], step_m: float | None) -> Frames:
        if len(files) == 1 and files[0].suffix.lower() in ARRAYS:
            return cls._of_array(_array(files[0]), str(files[0]), step_m)
        is_clouds = _are_clouds(files)
        for file in files:
            if file.suffix.lower() not in (CLOUDS if is_clouds else (*IMAGES, *ARRAYS)):
                raise DivespotError(f"{file}: {_no_frame(file)}")
        names = tuple(str(file) for file in files)
        return cls(files, names, step_m, _times(files), names[0], is_clouds=is_clouds)

    @classmethod
    def _of_array(cls, array: NDArray[Any], name: str, step_m: float | None) -> Frames:
        if array.dtype.kind not in "iuf" or array.ndim not in (2, 3) or 0 in array.shape:
            raise DivespotError(
                f"{name}: has shape {array.shape} and dtype {array.dtype}: depth of shape (h, w) "
                "or (n, h, w) is needed"
            )
        stack = array if array.ndim == 3 else array[None]
        names = tuple(f"{name} {number}" for number in range(1, len(stack) + 1))
        return cls(stack, names, step_m)  # type: ignore[arg-type]  # an array is a sequence

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[NDArray[np.float32]]:
        return (self[number] for number in range(len(self)))

    def __getitem__(self, number: int) -> NDArray[np.float32]:
        """Return a frame's depths in metres; values not above 0 are pixels without depth."""
        item = self.items[number]
        array = _image(item) if isinstance(item, Path) else item
        step_m = self.step_m
        if step_m is None:
            step_m = STEP_M if array.dtype.kind in "iu" else 1.0
        with np.errstate(over="ignore", invalid="ignore"):
            depth = np.ascontiguousarray(array.astype(np.float32) * np.float32(step_m))
        if array.dtype == np.uint16:
            depth[array == UNSEEN] = 0.0
        return depth


def _in_order(folder: Path) -> list[Path]:
    """Return the frames in a folder, or else its clouds, in the order of numbers in their names."""
    try:
        held = list(folder.iterdir())
    except OSError as error:
        raise unreadable(folder, error) from None
    found = [f for f in held if f.suffix.lower() in (*IMAGES, *ARRAYS)]
    found = found or [f for f in held if f.suffix.lower() in CLOUDS]
    if not found:
        raise DivespotError(f"{folder}: {_nothing(folder)}")
    return sorted(found, key=lambda file: (_key(file.stem), file.name))


def _are_clouds(files: Sequence[Path]) -> bool:
    return bool(files) and files[0].suffix.lower() in CLOUDS


def holds_clouds(path: Path) -> bool:
    """Return whether a path is a folder of clouds without depth images."""
    try:
        return os.path.isdir(path) and _are_clouds(_in_order(path))  # noqa: PTH112 - as above
    except DivespotError:
        return False


def _nothing(folder: Path) -> str:
    """Return what a folder without frames holds, and what is needed."""
    for file in sorted(folder.iterdir()):
        if is_recording(file) or file.suffix.lower() in OTHER_CLOUDS:
            return f"{file.name}: {_no_frame(file)}"
    return f"holds no frames: {', '.join((*IMAGES, *ARRAYS, *CLOUDS))} are needed"


def _no_frame(file: Path) -> str:
    """Return why a file is not a frame, and what is needed."""
    if file.suffix.lower() in (*CLOUDS, *OTHER_CLOUDS):
        return f"is a cloud: a sequence of {' or '.join(CLOUDS)} only, a file a frame, is needed"
    if is_recording(file):
        return "is a recording: it is needed by itself, by its own path"
    kinds = ", ".join((*IMAGES, *ARRAYS, *BAGS, *VIDEOS, *CLOUDS))
    return f"is no frame: depth of 16 bits or more is needed, as {kinds}"


def _key(stem: str) -> list[tuple[int, float, str]]:
    parts = re.split(r"(\d+(?:\.\d+)?)", stem)
    return [(0, float(p), "") if p[:1].isdigit() else (1, 0.0, p) for p in parts if p]


def _times(files: list[Path]) -> tuple[float, ...] | None:
    """Return the times in names such as 1305031102.160407.png."""
    times = [re.fullmatch(r"(\d+\.\d+)", file.stem) for file in files]
    return tuple(float(one[1]) for one in times if one) if all(times) and times else None


def _array(file: Path) -> NDArray[Any]:
    try:
        found = np.load(file, mmap_mode="r" if file.suffix.lower() == ".npy" else None)
        if not isinstance(found, np.ndarray):
            found = _chosen(dict(found), file)
    except OSError as error:
        raise unreadable(file, error) from None
    except (ValueError, EOFError, BadZipFile):
        raise DivespotError(f"{file}: is no array of numbers: one of depth is needed") from None
    return np.asarray(found)


def _chosen(arrays: dict[str, NDArray[Any]], file: Path) -> NDArray[Any]:
    if "depth" in arrays:
        return arrays["depth"]
    if len(arrays) == 1:
        return next(iter(arrays.values()))
    raise DivespotError(f"{file}: holds {len(arrays)} arrays: one, or one named depth, is needed")


def _image(file: Path) -> NDArray[Any]:
    array = _array(file) if file.suffix.lower() in ARRAYS else _picture(file)
    if array.ndim != 2:
        raise DivespotError(f"{file}: has shape {array.shape}: one depth a pixel is needed")
    if array.dtype == np.uint8:
        raise DivespotError(
            f"{file}: has 8 bits a pixel, as colours have: depth of 16 bits or more is needed"
        )
    return array


def _picture(file: Path) -> NDArray[Any]:
    pil = extra("PIL.Image", "frames", "depth images need Pillow")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # damaged files are reported below
            with pil.open(file) as image:
                pixels = image.width * image.height
                found = np.asarray(image) if pixels <= MOST_PIXELS else None
    except OSError as error:
        raise unreadable(file, error) from None
    except Exception:  # noqa: BLE001 - decoders raise anything on damaged images
        raise DivespotError(f"{file}: is damaged, or no image: one of depth is needed") from None
    if found is None:
        raise DivespotError(f"{file}: has {pixels} pixels: at most {MOST_PIXELS} are needed")
    return found


def write_png(file: Path, depth: NDArray[np.uint16]) -> None:
    """Write a 16-bit depth image."""
    pil = extra("PIL.Image", "frames", "depth images need Pillow")
    pil.fromarray(depth).save(file)
