"""Objects on the floor or above it: frozen records, checked when created."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from divespot.simulate.checks import require, require_positive

if TYPE_CHECKING:
    from divespot.simulate.solids import XYZ, Part

XY: TypeAlias = tuple[float, float]


@dataclass(frozen=True)
class Wall:
    """An upright wall from one point to another in plan.

    With `leaned_on`, piles that reach it are cut at its face; such a wall runs along x or y.
    """

    start_m: XY
    end_m: XY
    height_m: float = 1.0
    thickness_m: float = 0.1
    leaned_on: bool = False

    def __post_init__(self) -> None:
        require_positive(self, "height_m", "thickness_m")
        spans = [b != a for a, b in zip(self.start_m, self.end_m, strict=True)]
        require(any(spans), f"a wall starts and ends at {self.start_m}: two points are needed")
        require(
            not (self.leaned_on and all(spans)),
            "a wall that piles lean on runs askew: one along x or along y is needed",
        )


@dataclass(frozen=True)
class Rod:
    """A thin upright cylinder, such as a support of the rail."""

    center_m: XY
    radius_m: float = 0.02
    height_m: float = 1.45

    def __post_init__(self) -> None:
        require_positive(self, "radius_m", "height_m")


@dataclass(frozen=True)
class Box:
    """A sharp-edged box standing on the floor."""

    center_m: XY
    size_m: XYZ
    heading_deg: float = 0.0

    def __post_init__(self) -> None:
        require(
            all(math.isfinite(side) and side > 0 for side in self.size_m),
            f"Box.size_m is {self.size_m}: three numbers above 0 are needed",
        )


@dataclass(frozen=True)
class Person:
    """A person passing: visible only in the given frames, one stride further in each.

    With `on_pile`, the person stands on the surface, including piles.
    """

    center_m: XY
    stride_m: XY = (0.25, 0.0)
    frames: tuple[int, ...] = (0,)
    height_m: float = 1.75
    on_pile: bool = False

    def __post_init__(self) -> None:
        require_positive(self, "height_m")


@dataclass(frozen=True)
class RoundWall:
    """An upright wall along an arc; piles are cut at its inner side.

    It runs anticlockwise from `from_deg`, an angle from x, over `turn_deg`.
    """

    center_m: XY
    radius_m: float
    height_m: float
    thickness_m: float = 0.1
    from_deg: float = 0.0
    turn_deg: float = 180.0

    def __post_init__(self) -> None:
        require_positive(self, "radius_m", "height_m", "thickness_m")
        require(
            0 < self.turn_deg <= 360,
            f"RoundWall.turn_deg is {self.turn_deg}: an angle above 0 and up to 360 is needed",
        )


@dataclass(frozen=True)
class Hanging:
    """Something above the piles, made of solids; it does not change the piles.

    Parameters
    ----------
    what
        Name of its kind.
    solids
        Its solids; heights are above z = 0, or above the surface at `rests_at_m`.
    frames
        Frames in which it is visible; by default all.
    rests_at_m
        A position in plan where it touches the surface.
    """

    what: str
    solids: tuple[Part, ...]
    frames: tuple[int, ...] | None = None
    rests_at_m: XY | None = None


Thing: TypeAlias = Wall | RoundWall | Rod | Box | Person | Hanging
