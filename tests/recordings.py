"""Recordings that tests write with the libraries that read them."""

from __future__ import annotations

import json
import struct
from fractions import Fraction
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from typing_extensions import Self

IMAGE, CAMERA = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"
PACKED = "sensor_msgs/msg/CompressedImage"
#: Nanoseconds from one frame to the next, and from when it was taken to when it was recorded.
PERIOD_NS, LATE_NS = 33_333_000, 5_000_000
START_NS = 1_700_000_000_000_000_000


class Bag:
    """A recording of ROS that is being written: ``bag`` (ROS 1), ``mcap`` or ``sqlite``."""

    def __init__(self, path: Path, kind: str) -> None:
        from rosbags import rosbag1, rosbag2, typesys  # noqa: PLC0415 - may be absent

        self.is_old = kind == "bag"
        stores = typesys.Stores
        self.store = typesys.get_typestore(
            stores.ROS1_NOETIC if self.is_old else stores.ROS2_HUMBLE
        )
        plugins = {
            "mcap": rosbag2.StoragePlugin.MCAP,
            "sqlite": rosbag2.StoragePlugin.SQLITE3,
        }
        self.writer: Any = (
            rosbag1.Writer(path)
            if self.is_old
            else rosbag2.Writer(path, version=9, storage_plugin=plugins[kind])
        )
        self.topics: dict[str, Any] = {}

    def __enter__(self) -> Self:
        self.writer.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.writer.close()

    def header(self, time_ns: int) -> Any:  # noqa: ANN401 - a type of the store's
        types = self.store.types
        stamp = types["builtin_interfaces/msg/Time"](*divmod(time_ns, 10**9))
        more = {"seq": 0} if self.is_old else {}
        return types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera", **more)

    def write(self, topic: str, kind: str, time_ns: int, **fields: Any) -> None:  # noqa: ANN401 - as many types as messages
        message = self.store.types[kind](**fields)
        if topic not in self.topics:
            self.topics[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        store = self.store
        pack = store.serialize_ros1 if self.is_old else store.serialize_cdr
        self.writer.write(self.topics[topic], time_ns + LATE_NS, pack(message, kind))

    def images(self, topic: str, depth: Iterable[np.ndarray], encoding: str, pad: int = 0) -> None:
        for number, frame in enumerate(depth):
            time_ns = START_NS + number * PERIOD_NS
            lines = np.ascontiguousarray(frame).view(np.uint8).reshape(len(frame), -1)
            data = np.pad(lines, ((0, 0), (0, pad)), constant_values=7)
            self.write(
                topic,
                IMAGE,
                time_ns,
                header=self.header(time_ns),
                height=frame.shape[0],
                width=frame.shape[1],
                encoding=encoding,
                is_bigendian=int(frame.dtype.byteorder == ">"),
                step=data.shape[1],
                data=data.ravel(),
            )

    def packed(self, topic: str, depth: Iterable[np.ndarray], form: str) -> None:
        """Write images as the transport compressedDepth does: PNG after 12 bytes."""
        from PIL import Image  # noqa: PLC0415 - may be absent

        for number, frame in enumerate(depth):
            time_ns, png = START_NS + number * PERIOD_NS, BytesIO()
            Image.fromarray(frame).save(png, "PNG")
            data = np.frombuffer(bytes(12) + png.getvalue(), np.uint8)
            self.write(topic, PACKED, time_ns, header=self.header(time_ns), format=form, data=data)

    def camera(
        self,
        topic: str,
        k: list[float],
        size: tuple[int, int],
        *,
        d: list[float] | None = None,
        p: list[float] | None = None,
        model: str = "plumb_bob",
    ) -> None:
        p = p or [*k[:3], 0.0, *k[3:6], 0.0, *k[6:], 0.0]
        region = self.store.types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, do_rectify=False)
        matrices = {"k": k, "d": d or [0.0] * 5, "r": np.eye(3).ravel(), "p": p}
        self.write(
            topic,
            CAMERA,
            START_NS,
            header=self.header(START_NS),
            height=size[1],
            width=size[0],
            distortion_model=model,
            binning_x=0,
            binning_y=0,
            roi=region,
            **{
                name.upper() if self.is_old else name: np.array(values, np.float64)
                for name, values in matrices.items()
            },
        )


def write_mkv(path: Path, tracks: dict[str, np.ndarray], calibration: object = None) -> None:
    """Write tracks of 16 bits, big endian, as Azure Kinect's recorder does."""
    import av  # noqa: PLC0415 - may be absent

    tick = Fraction(1, 1_000_000)
    with av.open(str(path), "w", format="matroska", options={"allow_raw_vfw": "1"}) as container:
        streams = []
        for name, depth in tracks.items():
            stream: Any = container.add_stream("rawvideo", rate=30)
            stream.height, stream.width = depth.shape[1:]
            stream.pix_fmt, stream.time_base = "gray16be", tick
            stream.metadata["title"] = name
            streams.append(stream)
        if calibration is not None:
            text = json.dumps(calibration).encode() + b"\0"
            container.add_attachment("calibration.json", "application/octet-stream", text)
        for stream, depth in zip(streams, tracks.values(), strict=True):
            for number, image in enumerate(depth):
                frame = av.VideoFrame.from_ndarray(image, format="gray16be")
                frame.pts, frame.time_base = number * 33_000, tick
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
    _name_as_kinect_does(path)


def _name_as_kinect_does(path: Path) -> None:
    """Give tracks the code b16g, which FFmpeg reads but does not write."""
    plain = struct.pack("<HHI", 1, 16, 0)  # planes, bits and code in a BITMAPINFOHEADER
    path.write_bytes(path.read_bytes().replace(plain, plain[:4] + b"b16g"))
