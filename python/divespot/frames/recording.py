"""Recordings: frames that are played one after the other, as none is read before it is needed."""

from __future__ import annotations

import os
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from divespot.frames.intrinsics import Intrinsics

#: Endings of recordings of ROS 1 (which RealSense's viewer writes) and of ROS 2.
BAGS = (".bag", ".mcap", ".db3")
#: Endings of recordings of Azure Kinect.
VIDEOS = (".mkv",)
#: What a recording of ROS 2 that is a folder holds.
FOLDER_OF_BAG = "metadata.yaml"


def is_bag(path: Path) -> bool:
    """Return whether this is a recording of ROS."""
    is_file = path.suffix.lower() in BAGS
    return is_file or os.path.isfile(path / FOLDER_OF_BAG)  # noqa: PTH113 - as of any name


def is_video(path: Path) -> bool:
    """Return whether this is a recording of Azure Kinect."""
    return path.suffix.lower() in VIDEOS


def is_recording(path: Path) -> bool:
    """Return whether this is a recording, which may hold its camera's intrinsics."""
    return is_bag(path) or is_video(path)


@contextmanager
def opening(path: Path, needed: str) -> Iterator[None]:
    """Say of whatever a decoder raises what is wrong with a recording, and what is needed."""
    try:
        path.stat()  # says why it cannot be read, if so
        yield
    except (DivespotError, MemoryError):
        raise
    except OSError as error:
        raise DivespotError(f"{path}: cannot be read ({error.strerror or error})") from None
    except Exception:  # noqa: BLE001 - a damaged recording raises whatever its decoder does
        raise DivespotError(
            f"{path}: is truncated or damaged, or no recording of {needed}"
        ) from None


@dataclass(eq=False)
class Recording:
    """Frames of a recording.

    Attributes
    ----------
    path
        The recording.
    play
        Begins with the first frame again.
    times_s
        When each frame was taken.
    intrinsics
        The camera's, or why there are none.
    step_m
        Metres in a unit of depth, where the recording says so.

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
        """Return a frame: going back begins anew."""
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
        raise DivespotError(f"{self.path}: ends after {self._played} of {len(self)} frames")
