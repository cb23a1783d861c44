"""Recordings of Azure Kinect: Matroska, with a depth track and the device's calibration."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.frames.intrinsics import Intrinsics, parsed
from divespot.frames.recording import Recording, opening

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

#: Pixel formats of depth.
GRAYS = ("gray16be", "gray16le")
#: Name of the depth track among others of 16 bits (infrared), and of the calibration attachment.
TRACK, CALIBRATION = "DEPTH", "calibration.json"
#: Depth modes by the size of their images: width of the whole sensor in binned pixels, and where
#: the image begins in it.
MODES = {
    (320, 288): (512, (96, 90)),
    (640, 576): (1024, (192, 180)),
    (512, 512): (512, (0, 0)),
    (1024, 1024): (1024, (0, 0)),
}
#: Width of the sensor in pixels for which the calibration is stated.
SENSOR_PX = 1024
LENS = "CALIBRATION_LensDistortionModelBrownConrady"
PURPOSE = "CALIBRATION_CameraPurposeDepth"
#: Id of the segment that holds all frames, and the number of bytes in which it must begin.
SEGMENT, HEAD_BYTES = b"\x18\x53\x80\x67", 4096


def read_mkv(path: Path) -> Recording:
    """Open a recording of Azure Kinect.

    Raises
    ------
    DivespotError
        The recording cannot be read, or has no depth track.

    """
    with _opened(path) as container:
        _require_whole(path)
        track = _track(container, path)
        size = (track.width, track.height)
        calibrations = [
            one.data
            for one in container.streams
            if one.type == "attachment" and one.name == CALIBRATION
        ]
        lens = _intrinsics(calibrations[0] if calibrations else b"", size)
        packets = (packet for packet in container.demux(track) if packet.size)
        times_s = tuple(float(packet.pts * packet.time_base) for packet in packets)
    if not times_s:
        raise DivespotError(f"{path}: its track of depth is empty: frames are needed")
    return Recording(path, lambda: _frames(path), times_s, lens)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    av = extra("av", "kinect", "recordings of Azure Kinect need PyAV")
    with opening(path, "Azure Kinect: MKV is needed"), av.open(str(path)) as container:
        yield container


def _require_whole(path: Path) -> None:
    """Raise DivespotError if the file is truncated; FFmpeg would only find fewer frames."""
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    at = head.index(SEGMENT) + len(SEGMENT)
    width = 9 - head[at].bit_length()  # the number of leading zeros is the length of the size
    most = (1 << 7 * width) - 1
    size = int.from_bytes(head[at : at + width], "big") & most
    needed, given = at + width + size, path.stat().st_size
    if size != most and given < needed:  # all ones: the size is unknown
        raise DivespotError(f"{path}: is truncated: {needed} bytes are needed, {given} are there")


def _track(container: Any, path: Path) -> Any:  # noqa: ANN401 - PyAV has types of its own
    videos = container.streams.video
    grays = [one for one in videos if one.codec_context.pix_fmt in GRAYS]
    named = [one for one in grays if one.metadata.get("title") == TRACK]
    found = named or grays
    if len(found) == 1:
        return found[0]
    held = ", ".join(f"{one.metadata.get('title', 'unnamed')} ({one.pix_fmt})" for one in videos)
    raise DivespotError(
        f"{path}: holds {len(found)} tracks of depth, of {held or 'no pictures'}: one of 16 bits, "
        f"called {TRACK} where there are others, is needed"
    )


def _frames(path: Path) -> Iterator[NDArray[Any]]:
    with _opened(path) as container:
        for frame in container.decode(_track(container, path)):
            yield np.asarray(frame.to_ndarray())


def _intrinsics(attached: bytes, size: tuple[int, int]) -> Intrinsics | str:
    """Return the intrinsics of a depth mode, or why there are none."""
    try:
        cameras = json.loads(attached.rstrip(b"\0"))["CalibrationInformation"]["Cameras"]
        camera = next(one for one in cameras if one["Purpose"] == PURPOSE)
        return _of_mode(camera, size)
    except (ValueError, KeyError, TypeError, StopIteration, RecursionError, DivespotError):
        return f"holds no calibration ({CALIBRATION}) with the intrinsics of its depth"


def _of_mode(camera: Mapping[str, Any], size: tuple[int, int]) -> Intrinsics:
    """Return intrinsics in pixels of a depth image, from fractions of the sensor's width."""
    is_known = camera["Intrinsics"]["ModelType"] == LENS and size in MODES
    if not is_known or (camera["SensorWidth"], camera["SensorHeight"]) != (SENSOR_PX, SENSOR_PX):
        raise DivespotError("is of another camera: an Azure Kinect is needed")
    edge_px, (left, top) = MODES[size]
    cx, cy, fx, fy, *lens = map(float, camera["Intrinsics"]["ModelParameters"])
    middle = (cx * edge_px - left - 0.5, cy * edge_px - top - 0.5)
    pixels = [*middle, fx * edge_px, fy * edge_px, *lens]
    return parsed({"parameters": pixels, "width": size[0], "height": size[1]})
