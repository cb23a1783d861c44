"""Vessels whose floor and outline are known before the scan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from divespot.simulate.checks import require

if TYPE_CHECKING:
    from divespot.simulate.things import XY


@dataclass(frozen=True)
class Vessel:
    """A bin, bed or silo whose floor and inner outline are given, not measured.

    Parameters
    ----------
    outline_m
        Corners of its inside in plan, in the scene; the first is not repeated.
    floor_m
        Height of its floor in the scene.
    """

    outline_m: tuple[XY, ...]
    floor_m: float = 0.0

    def __post_init__(self) -> None:
        corners = len(self.outline_m)
        require(corners >= 3, f"Vessel.outline_m has {corners} corners: 3 or more are needed")
