"""Rays of a depth camera's pixels: pinhole and lens distortion, in the formats cameras use."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from divespot._arguments import as_floats
from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.frames.text import text_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Coefficients of a lens: k1, k2, p1, p2, k3, k4, k5, k6, as OpenCV and Azure Kinect order them.
MOST_COEFFICIENTS = 8
#: Largest intrinsics file in bytes.
MOST_BYTES = 1 << 20
#: Unless an image is cropped, the optical axis is within this share of its width from the middle.
OFF_MIDDLE = 0.25
#: Iterations for the ray of a distorted pixel, and the largest remaining error in pixels.
STEPS, EXACT_PX = 30, 1e-3
#: Names of lens models without distortion, and of those with the coefficients above.
PLAIN = ("", "none", "pinhole", "distortion.none")
RATIONAL = (
    *("plumb_bob", "rational_polynomial", "brown_conrady", "distortion.brown_conrady"),
    *("inverse_brown_conrady", "distortion.inverse_brown_conrady", "opencv", "radtan"),
)


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera with a lens.

    Attributes
    ----------
    fx, fy
        Focal lengths in pixels.
    cx, cy
        Where the optical axis meets the image, in pixels; the centre of the first is (0, 0).
    distortion
        k1, k2, p1, p2, k3, k4, k5, k6 of the rational model, or the first few of them.
    size
        Columns and rows of the images that the intrinsics are for, if stated.

    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, ...] = ()
    size: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        numbers = (self.fx, self.fy, self.cx, self.cy, *self.distortion)
        if not all(math.isfinite(v) for v in numbers) or min(self.fx, self.fy) <= 0.0:
            raise DivespotError(
                f"the intrinsics are fx, fy = {self.fx}, {self.fy} and cx, cy = {self.cx}, "
                f"{self.cy}: finite numbers, with focal lengths above 0, are needed"
            )
        if len(self.distortion) > MOST_COEFFICIENTS:
            raise DivespotError(
                f"{len(self.distortion)} coefficients of distortion were given: at most "
                f"{MOST_COEFFICIENTS} are needed (k1, k2, p1, p2, k3, k4, k5, k6)"
            )

    @classmethod
    def of(cls, given: Given) -> Intrinsics:
        """Return intrinsics from a file, a mapping, a 3 × 3 matrix, or three or four numbers."""
        if isinstance(given, Intrinsics):
            return given
        if isinstance(given, str | os.PathLike):
            return read_intrinsics(given)
        if isinstance(given, Mapping):
            return parsed(given)
        array = as_floats("the intrinsics", given).astype(np.float64, copy=False)
        if array.shape == (3, 3):
            return of_matrix(array.ravel().tolist())
        if array.shape == (3,):  # one focal length
            focal, cx, cy = array.tolist()
            return cls(focal, focal, cx, cy)
        if array.shape == (4,):
            return cls(*array.tolist())
        raise DivespotError(
            f"the intrinsics have shape {array.shape}: f, cx, cy or fx, fy, cx, cy or a 3 x 3 "
            "matrix is needed"
        )

    def require_size(self, rows: int, columns: int) -> None:
        """Raise DivespotError if images have another size than the intrinsics are for."""
        if self.size is not None and self.size != (columns, rows):
            raise DivespotError(
                f"the frames have {columns} x {rows} pixels, the intrinsics are for "
                f"{self.size[0]} x {self.size[1]}: those of this image size are needed"
            )

    def doubts(self, rows: int, columns: int) -> tuple[str, ...]:
        """Return a warning if the optical axis is too far from the middle of the images."""
        off = max(abs(self.cx / columns - 0.5), abs(self.cy / rows - 0.5))
        said = (
            f"the optical axis meets the image at ({self.cx:.0f}, {self.cy:.0f}) of {columns} x "
            f"{rows} pixels: the intrinsics may be for images of another size"
        )
        return (said,) if off > OFF_MIDDLE else ()

    def rays(self, rows: int, columns: int) -> NDArray[np.float64]:
        """Return the pixels' unit rays, shape ``(rows * columns, 3)``; NaN outside the lens."""
        u, v = np.meshgrid(np.arange(columns, dtype=np.float64), np.arange(rows, dtype=np.float64))
        seen = np.stack([(u.ravel() - self.cx) / self.fx, (v.ravel() - self.cy) / self.fy])
        x, y = self._undistorted(seen) if any(self.distortion) else seen
        length = np.sqrt(x * x + y * y + 1.0)
        return np.stack([x / length, y / length, 1.0 / length], axis=1)

    def _undistorted(self, seen: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return undistorted positions of distorted ones, by fixed-point iteration."""
        at = seen.copy()
        with np.errstate(all="ignore"):
            for _ in range(STEPS):
                off = self.distorted(at) - seen
                at -= off
            off = np.abs(self.distorted(at) - seen) * np.array([[self.fx], [self.fy]])
        at[:, ~(off.max(axis=0) < EXACT_PX)] = np.nan
        return at

    def distorted(self, at: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return distorted positions for undistorted ones, shape ``(2, n)``, in focal lengths."""
        k1, k2, p1, p2, k3, k4, k5, k6 = (*self.distortion, *(0.0,) * 8)[:8]
        x, y = at
        r2 = x * x + y * y
        above = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        radial = above / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        across = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        down = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.stack([x * radial + across, y * radial + down])


Given: TypeAlias = (
    "Intrinsics | str | os.PathLike[str] | Mapping[str, Any] | Sequence[float] | ArrayLike"
)


def read_intrinsics(path: str | os.PathLike[str]) -> Intrinsics:
    """Read a camera's intrinsics.

    Parameters
    ----------
    path
        JSON, or YAML (extra ``frames``): Open3D's ``intrinsic_matrix`` (column by column),
        RealSense's ``fx fy ppx ppy``, the ``K`` and ``D`` of a ROS ``CameraInfo`` or its YAML, or
        Azure Kinect's ``parameters`` or ``fx fy cx cy k1 .. k6 p1 p2``.

    Raises
    ------
    DivespotError
        The file cannot be read or holds none of these.

    Examples
    --------
    >>> from pathlib import Path
    >>> from divespot.frames import read_intrinsics
    >>> _ = Path("K.json").write_text('{"fx": 500, "fy": 500, "ppx": 319.5, "ppy": 239.5}')
    >>> read_intrinsics("K.json").cx
    319.5

    """
    file = Path(os.fsdecode(path))
    text = text_of(file, "intrinsics as JSON or YAML are needed", MOST_BYTES)
    try:
        return parsed(_values(file, text))
    except DivespotError as error:
        raise DivespotError(f"{file}: {error}") from None


def _values(file: Path, text: str) -> Any:  # noqa: ANN401 - whatever the file holds
    if file.suffix.lower() in (".yaml", ".yml"):
        yaml = extra("yaml", "frames", "YAML needs PyYAML")
        # OpenCV writes a first line that YAML readers refuse, and a tag of its own.
        plain = text.replace("!!opencv-matrix", "")
        lines = [line for line in plain.splitlines() if not line.startswith("%YAML")]
        try:
            return yaml.safe_load("\n".join(lines))
        except yaml.YAMLError:
            raise DivespotError("is no valid YAML: intrinsics as YAML are needed") from None
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise DivespotError("is no valid JSON: intrinsics as JSON are needed") from None


def parsed(values: Any) -> Intrinsics:  # noqa: ANN401 - whatever a file holds
    """Return the intrinsics in a mapping, in any of the known formats."""
    if not isinstance(values, Mapping):
        raise DivespotError("holds no object: one with intrinsics is needed")
    for way in (_open3d, _ros, _kinect_calibration, _named):
        try:
            found = way(values)
        except DivespotError:
            raise
        except (TypeError, ValueError, KeyError, IndexError, OverflowError):
            raise DivespotError(
                "holds intrinsics of which some are no numbers: numbers are needed"
            ) from None
        if found is not None:
            return found
    for inner in ("depth", "depth_camera", "depth_intrinsics", "intrinsics", "camera", "color"):
        if isinstance(values.get(inner), Mapping):
            return parsed(values[inner])
    raise DivespotError(
        "holds no intrinsics: intrinsic_matrix (Open3D), fx fy ppx ppy (RealSense), K and D (ROS) "
        "or fx fy cx cy k1 .. k6 p1 p2 (Azure Kinect) are needed"
    )


def _size(values: Mapping[str, Any]) -> tuple[int, int] | None:
    columns = values.get("width", values.get("image_width"))
    rows = values.get("height", values.get("image_height"))
    return None if columns is None or rows is None else (int(columns), int(rows))


def _numbers(value: Any) -> list[float]:  # noqa: ANN401 - whatever a file holds
    data = value["data"] if isinstance(value, Mapping) else value
    return [float(v) for v in np.asarray(data, dtype=np.float64).ravel()]


def of_matrix(
    k: Sequence[float], distortion: Sequence[float] = (), size: tuple[int, int] | None = None
) -> Intrinsics:
    """Return the intrinsics of a 3 × 3 matrix, row by row or column by column."""
    if len(k) != 9:
        raise DivespotError(f"the intrinsic matrix has {len(k)} numbers: 9 are needed")
    by_column = k[2] == 0.0 and k[5] == 0.0 and (k[6] != 0.0 or k[7] != 0.0)
    cx, cy = (k[6], k[7]) if by_column else (k[2], k[5])
    return Intrinsics(k[0], k[4], cx, cy, tuple(distortion), size)


def _open3d(values: Mapping[str, Any]) -> Intrinsics | None:
    if "intrinsic_matrix" not in values:
        return None
    return of_matrix(_numbers(values["intrinsic_matrix"]), (), _size(values))


def _ros(values: Mapping[str, Any]) -> Intrinsics | None:
    for matrix, lens in (("K", "D"), ("k", "d"), ("camera_matrix", "distortion_coefficients")):
        if matrix in values:
            model = values.get("distortion_model")
            coefficients = _lens(_numbers(values.get(lens) or []), model)
            return of_matrix(_numbers(values[matrix]), coefficients, _size(values))
    return None


def _kinect_calibration(values: Mapping[str, Any]) -> Intrinsics | None:
    """Return intrinsics of Azure Kinect's SDK: a list of parameters in its struct's order."""
    given = values.get("parameters")
    if not isinstance(given, Sequence) or len(given) < 14:
        return None
    cx, cy, fx, fy, k1, k2, k3, k4, k5, k6, _, _, p2, p1 = _numbers(given)[:14]
    return Intrinsics(fx, fy, cx, cy, (k1, k2, p1, p2, k3, k4, k5, k6), _size(values))


def _named(values: Mapping[str, Any]) -> Intrinsics | None:
    if "fx" not in values or "fy" not in values:
        return None
    cx, cy = (values.get(name, values.get(f"pp{name[1]}")) for name in ("cx", "cy"))
    if cx is None or cy is None:
        return None
    named = [float(values.get(k, 0.0)) for k in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")]
    listed = values.get("coeffs", values.get("distortion"))
    coefficients = named if listed is None else _numbers(listed)
    lens = _lens(coefficients, values.get("model"))
    return Intrinsics(
        float(values["fx"]), float(values["fy"]), float(cx), float(cy), lens, _size(values)
    )


def _lens(coefficients: list[float], model: object) -> tuple[float, ...]:
    """Return the coefficients of a lens, if its model is known."""
    name = str(model or "").lower().replace(" ", "_")  # "Brown Conrady" in RealSense's bags
    if not any(coefficients) or name in PLAIN:
        return () if name in PLAIN and name else tuple(coefficients) if any(coefficients) else ()
    if name in RATIONAL:
        return tuple(coefficients)
    raise DivespotError(
        f"the distortion model is {model!r}: plumb_bob, rational_polynomial or brown_conrady is "
        "needed, or frames that were undistorted"
    )
