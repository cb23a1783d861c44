"""The floor that piles stand on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot.simulate.checks import require, require_not_negative, require_positive

if TYPE_CHECKING:
    from divespot.simulate.level import Level


@dataclass(frozen=True)
class Floor:
    """The floor that piles stand on; it extends beyond the measured strip.

    Parameters
    ----------
    length_m, width_m
        Extent along x and y, centred at the origin.
    node_m
        Spacing of the nodes between which floor and piles are bilinear.
    slope_deg
        Tilt of the whole floor, rising towards +x.
    wave_m, wave_length_m
        Amplitude and typical length of long waves.
    fold_deg
        Angle between two planes that meet in the line x = `edge_m`; the far one rises.
    step_m
        Height by which the floor rises in the line x = `edge_m`.
    edge_m
        Position of fold and step along x.
    levels
        Parts that are higher or lower.
    """

    length_m: float = 3.5
    width_m: float = 3.2
    node_m: float = 0.004
    slope_deg: float = 0.0
    wave_m: float = 0.0
    wave_length_m: float = 2.0
    fold_deg: float = 0.0
    step_m: float = 0.0
    edge_m: float = 0.0
    levels: tuple[Level, ...] = ()

    def __post_init__(self) -> None:
        require_positive(self, "length_m", "width_m", "node_m", "wave_length_m")
        require_not_negative(self, "wave_m")
        for name in ("slope_deg", "fold_deg"):
            angle = getattr(self, name)
            require(abs(angle) < 45, f"Floor.{name} is {angle}: an angle below 45 is needed")
        nodes = self.length_m * self.width_m / self.node_m**2
        require(
            nodes <= 2e7,
            f"a floor of {nodes:.0f} nodes was asked for: 20 million at most are needed (a larger "
            "Floor.node_m)",
        )
