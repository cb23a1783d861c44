"""Recordings: their frames are read in order, each only when it is needed."""

from __future__ import annotations

import os
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError, unreadable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from divespot.frames.intrinsics import Intrinsics

#: Endings of recordings of ROS 1 (also written by RealSense's viewer) and of ROS 2.
BAGS = (".bag", ".mcap", ".db3")
#: Endings of recordings of Azure Kinect.
VIDEOS = (".mkv",)
#: A file in every ROS 2 recording that is a folder.
FOLDER_OF_BAG = "metadata.yaml"


def is_bag(path: Path) -> bool:
    """Return whether a path is a ROS recording."""
    is_file = path.suffix.lower() in BAGS
    return is_file or os.path.isfile(path / FOLDER_OF_BAG)  # noqa: PTH113 - as of any name


def is_video(path: Path) -> bool:
    """Return whether a path is an Azure Kinect recording."""
    return path.suffix.lower() in VIDEOS


def is_recording(path: Path) -> bool:
    """Return whether a path is a recording, which may hold its camera's intrinsics."""
    return is_bag(path) or is_video(path)


@contextmanager
def opening(path: Path, needed: str) -> Iterator[None]:
    """Turn any error of a decoder into one sentence that says what is wrong and needed."""
    try:
        path.stat()  # raises an error if the file cannot be read
        yield
    except (DivespotError, MemoryError):
        raise
    except OSError as error:
        raise unreadable(path, error) from None
    except Exception:  # noqa: BLE001 - decoders raise anything on damaged recordings
        raise DivespotError(
            f"{path}: is truncated or damaged, or no recording of {needed}"
        ) from None


@dataclass(eq=False)
class Recording:
    """The frames of a recording.

    Attributes
    ----------
    path
        The file or folder.
    play
        Starts again with the first frame.
    times_s
        Time of each frame.
    intrinsics
        The camera's intrinsics, or why there are none.
    step_m
        Metres per unit of depth, if the recording states it.

    """

    path: Path
    play: Callable[[], Iterator[NDArray[Any]]]
    times_s: tuple[float, ...]
    intrinsics: Intrinsics | str
    step_m: float | None = None
    _playing: Iterator[NDArray[Any]] = field(init=False)
    _played: int = field(default=0, init=False)
    _last: NDArray[Any] = field(init=False)

    def __post_init__(self) -> None:
        self._playing = self.play()

    def __len__(self) -> int:
        return len(self.times_s)

    def __getitem__(self, number: int) -> NDArray[Any]:
        """Return a frame; an earlier one than before restarts the recording."""
        if number == self._played - 1:
            return self._last
        if number < self._played:
            self._playing, self._played = self.play(), 0
        while self._played <= number:
            self._last = self._next()
            self._played += 1
        return self._last

    def _next(self) -> NDArray[Any]:
        for frame in self._playing:
            return frame
        raise DivespotError(
            f"{self.path}: ends after {self._played} frames: {len(self)} are needed"
        )
