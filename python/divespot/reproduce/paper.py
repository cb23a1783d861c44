"""The paper's figures, for comparison with those measured here."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

SHAPES: tuple[tuple[float, float], ...] = (
    (0.01376, 0.0172),
    (0.01367, 0.0238),
    (0.01376, 0.0174),
    (0.02760, 0.0142),
    (0.02758, 0.0151),
    (0.02748, 0.0185),
    (0.03430, 0.0201),
    (0.03408, 0.0263),
    (0.03414, 0.0247),
    (0.02789, 0.0039),
    (0.02771, 0.0103),
    (0.02775, 0.0091),
    (0.03456, 0.0125),
    (0.03472, 0.0081),
    (0.03481, 0.0053),
    (0.32900, 0.0179),
    (0.32743, 0.0226),
    (0.32817, 0.0204),
)
"""Estimated volume in m3 and mean error over 50 rounds of each shape."""

AREAS: Mapping[float, float] = MappingProxyType({1.3: 0.0197, 2.6: 0.0082, 5.2: 0.0203})
"""Mean error by area in m2."""

WITHIN = 0.0203
"""The largest of these, which the paper states as its accuracy."""

COMPRESSION: Mapping[float, tuple[float, float]] = MappingProxyType(
    {
        0.0: (1.0, 0.0203),
        0.01: (0.3104, 0.0168),
        0.02: (0.0822, 0.0255),
        0.05: (0.0145, 0.0317),
        0.1: (0.0038, 0.0572),
        0.2: (0.0011, 0.0854),
        0.25: (0.0007, 0.2618),
        0.3: (0.0005, 0.2945),
    }
)
"""Share of the points kept and mean error, by edge of the voxels in m; 0 is the scan itself."""

WHOLE, FILTER, POSE = (0.0203, 3.7729e-5), (0.0575, 9.7947e-4), (0.2899, 8.9829e-3)
"""Mean error and mean square error in m6 of the ablation: the whole method, without the filters,
without pose correction or ground calibration."""

CAMERA_HEIGHT: Mapping[float, float] = MappingProxyType({1.3: 0.1816, 2.6: 0.1478, 5.2: 0.1397})
"""Mean error by area with the ground from the camera's measured height."""

MIDPOINT: Mapping[float, float] = MappingProxyType({1.3: 0.0299, 2.6: 0.0239, 5.2: 0.0494})
"""Mean error by area with the ground from the midpoint of the peaks."""

RUNNING_S: Mapping[str, float] = MappingProxyType({"Jetson Orin": 86.3, "Jetson Nano": 432.9})
"""Running time of 300,000 points on the paper's boards."""
