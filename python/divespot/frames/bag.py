"""Recordings of ROS: rosbag (also of RealSense) and MCAP."""

from __future__ import annotations

from contextlib import contextmanager
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.frames.intrinsics import Intrinsics, parsed
from divespot.frames.recording import Recording, opening

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

#: Depth encodings and their NumPy types: integers are millimetres, floats metres (REP 118).
ENCODINGS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}
CAMERA = "sensor_msgs/msg/CameraInfo"
IMAGES = ("sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage")
#: Format names of compressed depth images: PNG after a header, which matters only for metres.
PACKED = ("16UC1; compressedDepth", "16UC1; compressedDepth png")
PACKED_TOPIC, PACKED_HEADER_BYTES = "/compressedDepth", 12
#: Endings of a stream's topics in RealSense's own recordings.
REALSENSE, REALSENSE_CAMERA = "/image/data", "/info/camera_info"
#: RealSense's names for the unit of depth; the second was used until 2018.
UNITS = ("Depth_Units", "Depth Units")


def read_bag(path: Path, topic: str | None) -> Recording:
    """Open one depth topic of a ROS recording.

    Raises
    ------
    DivespotError
        The recording cannot be read, has no depth topic, or has several and none was named.

    """
    with _opened(path) as bag:
        name = _depth_topic(bag, path, topic)
        times_s = tuple(_times_s(bag, name))
        lens = _intrinsics(bag, name)
        step_m = _step_m(bag, name)
    return Recording(path, lambda: _frames(path, name), times_s, lens, step_m)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    need = "recordings of ROS and RealSense need rosbags"
    reading, types = (extra(f"rosbags.{part}", "frames", need) for part in ("highlevel", "typesys"))
    # Recordings of older ROS 2 do not define their messages, which have not changed since.
    known = types.get_typestore(types.Stores.ROS2_HUMBLE)
    needed = "ROS: rosbag, or MCAP or SQLite of ROS 2, is needed"
    with opening(path, needed), reading.AnyReader([path], default_typestore=known) as bag:
        yield bag


def _messages(bag: Any, topic: str, *kinds: str) -> Iterator[tuple[int, Any]]:  # noqa: ANN401 - a reader
    """Yield the messages of a topic, with the time of recording in nanoseconds."""
    from_here = [one for one in bag.connections if one.topic == topic and one.msgtype in kinds]
    if from_here:
        for connection, time_ns, data in bag.messages(from_here):
            yield time_ns, bag.deserialize(data, connection.msgtype)


def _first(bag: Any, topic: str, *kinds: str) -> Any:  # noqa: ANN401 - a message, or None
    return next((message for _, message in _messages(bag, topic, *kinds)), None)


def _depth_topic(bag: Any, path: Path, topic: str | None) -> str:  # noqa: ANN401 - a reader
    """Return the only depth topic, or the one that was named."""
    images: dict[str, str] = {}
    for name in sorted({one.topic for one in bag.connections if one.msgtype in IMAGES}):
        message = _first(bag, name, *IMAGES)
        if message is not None:
            images[name] = _encoding(message)
    found = [name for name, encoding in images.items() if encoding in (*ENCODINGS, *PACKED)]
    if topic is None and len(found) == 1:
        return found[0]
    if topic in found:
        return str(topic)
    if found:
        was = "several topics of depth," if topic is None else f"no depth in {topic}, but in"
        raise DivespotError(
            f"{path}: holds {was} {', '.join(found)}: one is needed (--depth-topic)"
        )
    held = ", ".join(f"{name} ({encoding})" for name, encoding in images.items()) or "no images"
    raise DivespotError(
        f"{path}: holds no depth, but {held}: images of {', '.join(ENCODINGS)} are needed"
    )


def _encoding(message: Any) -> str:  # noqa: ANN401 - a message
    return str(message.format if hasattr(message, "format") else message.encoding)


def _times_s(bag: Any, topic: str) -> list[float]:  # noqa: ANN401 - a reader
    """Return the times of the frames; if they are not stated, the times of recording."""
    taken, recorded = [], []
    for time_ns, message in _messages(bag, topic, *IMAGES):
        stamp = message.header.stamp
        taken.append(stamp.sec + 1e-9 * stamp.nanosec)
        recorded.append(1e-9 * time_ns)
    return taken if all(taken) else recorded


def _intrinsics(bag: Any, topic: str) -> Intrinsics | str:  # noqa: ANN401 - a reader
    """Return the intrinsics of the camera in the same namespace, or why there are none."""
    topic = topic.removesuffix(PACKED_TOPIC)
    if topic.endswith(REALSENSE):
        name = topic.removesuffix(REALSENSE) + REALSENSE_CAMERA
    else:
        name = topic.rpartition("/")[0] + "/camera_info"
    message = _first(bag, name, CAMERA)
    if message is None:
        return f"holds no intrinsics in {name}"
    try:
        return _of_camera(message, is_rectified="rect" in topic.rpartition("/")[2])
    except DivespotError as error:
        return f"{name}: {error}"


def _of_camera(message: Any, *, is_rectified: bool) -> Intrinsics:  # noqa: ANN401 - a message
    """Return intrinsics; for a rectified image, those without distortion."""
    k, d, p = (_numbers(message, name) for name in "kdp")
    if not any(k):
        raise DivespotError("was not calibrated, its K is 0: focal lengths above 0 are needed")
    size = {"width": int(message.width), "height": int(message.height)}
    if is_rectified and any(p):
        return parsed({"k": [*p[0:3], *p[4:7], *p[8:11]], **size})
    return parsed({"k": k, "d": d, "distortion_model": message.distortion_model, **size})


def _numbers(message: Any, name: str) -> list[float]:  # noqa: ANN401 - a message
    """Return a matrix of a camera, whose name is in upper case in ROS 1."""
    values = getattr(message, name, None)
    return [float(v) for v in (getattr(message, name.upper()) if values is None else values)]


def _step_m(bag: Any, topic: str) -> float | None:  # noqa: ANN401 - a reader
    """Return the unit of depth that RealSense's own recordings state for the stream."""
    if not topic.endswith(REALSENSE):
        return None
    sensor = topic.removesuffix(REALSENSE).rpartition("/")[0]
    for unit in UNITS:
        for kind in ("std_msgs/msg/Float32", "std_msgs/msg/String"):  # ROS 1, ROS 2
            message = _first(bag, f"{sensor}/option/{unit}/value", kind)
            if message is not None:
                return float(message.data)
    return None


def _frames(path: Path, topic: str) -> Iterator[NDArray[Any]]:
    with _opened(path) as bag:
        for _, message in _messages(bag, topic, *IMAGES):
            yield _depth(message, f"{path}: {topic}")


def _depth(message: Any, name: str) -> NDArray[Any]:  # noqa: ANN401 - a message
    """Return the depths of an image, whose rows may be padded."""
    encoding = _encoding(message)
    if encoding in PACKED:
        return _unpacked(message)
    kind = ENCODINGS.get(encoding)
    if kind is None:
        raise DivespotError(f"{name}: changes to {encoding}: one encoding is needed")
    dtype = np.dtype((">" if message.is_bigendian else "<") + kind)
    rows, columns, step = message.height, message.width, message.step
    if len(message.data) != rows * step or step < columns * dtype.itemsize:
        raise DivespotError(
            f"{name}: an image of {columns} x {rows} pixels has {len(message.data)} bytes in rows "
            f"of {step}: {columns * dtype.itemsize} or more a row are needed"
        )
    lines = np.asarray(message.data, np.uint8).reshape(rows, step)[:, : columns * dtype.itemsize]
    return np.ascontiguousarray(lines).view(dtype).astype(dtype.newbyteorder("="))


def _unpacked(message: Any) -> NDArray[Any]:  # noqa: ANN401 - a message
    """Return the depths of a compressed image."""
    pil = extra("PIL.Image", "frames", "compressed depth images need Pillow")
    with pil.open(BytesIO(bytes(message.data[PACKED_HEADER_BYTES:])), formats=["PNG"]) as image:
        found = np.asarray(image)
    if found.ndim != 2 or found.dtype.itemsize < 2:
        raise ValueError(found.dtype)  # reported by the function that opened the recording
    return found.astype(np.uint16)
