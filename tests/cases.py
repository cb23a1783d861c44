"""Clouds on which every kernel is compared with its slow reference implementation."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Cloud = NDArray[Any]

UTM = np.array([482_310.0, 5_456_790.0, 312.0])


def scattered(count: int, seed: int = 0) -> Cloud:
    """Floor with a bump and some strays above: multiples of 2**-20 m, exact at any offset."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(0, 2, (count, 2))
    z = np.maximum(0.3 - np.hypot(*(xy - 1).T), 0) + rng.normal(0, 0.003, count)
    z[:: max(count // 30, 1)] += rng.uniform(0, 1, len(z[:: max(count // 30, 1)]))
    points: Cloud = np.round(np.c_[xy, z] * 2**20) / 2**20
    return points


def with_holes(points: Cloud) -> Cloud:
    """Put NaN or infinity into every seventh row."""
    points = points.copy()
    points[::7, 0] = np.nan
    points[3::7, 2] = np.inf
    points[5::7] = -np.inf
    return points


def cases() -> dict[str, Cloud]:
    """Return the table of cases by name."""
    cloud = scattered(1000)
    steps = np.arange(400.0)[:, None]
    exact = np.array([[0, 0, 0], [0.375, 0.5, 0], [-0.625, 0, 0], [0, 0, 0.625], [0.375, 0, -0.5]])
    return {
        "empty": np.empty((0, 3)),
        "one point": np.array([[3.0, -4.0, 5.0]]),
        "all equal": np.full((300, 3), 0.1),
        "collinear": steps * [0.01, 0.02, -0.005],
        "vertical line": steps * [0.0, 0.0, 0.0078125],
        "exactly on the radius": exact,
        "millimetres": np.round(cloud, 3),
        "centimetres": np.round(cloud, 2),
        "ten of each": np.repeat(cloud[:100], 10, axis=0),
        "random": cloud,
        "UTM": cloud + UTM,
        "wall": cloud[:, [0, 2, 1]],
        "far stray": np.r_[cloud, [[-3e5, 2e6, 20.0]]],
        "not finite": with_holes(cloud),
        "nothing finite": np.full((9, 3), np.nan),
        "float32": cloud.astype(np.float32),
        "Fortran order": np.asfortranarray(cloud),
        "negative strides": cloud[::-1, ::-1],
        "every other column": np.repeat(cloud, 2, axis=1)[:, ::2],
    }


CASES = cases()

WRONG_POINTS = {
    "flat": np.zeros(9),
    "two columns": np.zeros((9, 2)),
    "four columns": np.zeros((9, 4)),
    "scalar": 3.0,
    "objects": np.full((9, 3), None),
    "strings": np.full((9, 3), "1.0"),
    "complex": np.zeros((9, 3), complex),
    "truth values": np.zeros((9, 3), bool),
    "ragged": [[1.0, 2.0, 3.0], [4.0, 5.0]],
    "nothing": None,
    "too wide": [[0.0, 0.0, 0.0], [1e10, 0.0, 0.0]],
}
