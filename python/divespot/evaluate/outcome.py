"""The result of one scan, and the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from divespot.repeated import STABLE


@dataclass(frozen=True)
class PileOutcome:
    """A true pile, and its measurement.

    Attributes
    ----------
    truth_m3
        Its true volume.
    volume_m3, u95_m3
        The measured volume and its expanded uncertainty; None if no pile was found there.
    instead
        Why the object found there is not a pile; None if a pile was found, or nothing at all.
    repeat_m3
        How much the volume changed when slightly changed scans were measured; None if none
        were.

    """

    truth_m3: float
    volume_m3: float | None = None
    u95_m3: float | None = None
    instead: str | None = None
    repeat_m3: float | None = None

    @property
    def error(self) -> float:
        """Relative error; -1 for a pile that was not found."""
        return (self.volume_m3 or 0.0) / self.truth_m3 - 1.0

    @property
    def covered(self) -> bool:
        """Whether the truth lies within the expanded uncertainty."""
        if self.volume_m3 is None or self.u95_m3 is None:
            return False
        return abs(self.volume_m3 - self.truth_m3) <= self.u95_m3

    @property
    def stable(self) -> bool | None:
        """Whether it changed by at most a third of its u95; None if that was not tested."""
        if self.repeat_m3 is None or self.u95_m3 is None:
            return None
        return self.repeat_m3 <= STABLE * self.u95_m3


@dataclass(frozen=True)
class Extra:
    """A false pile: what it really is, and its measured volume."""

    what: str
    volume_m3: float


@dataclass(frozen=True)
class Outcome:
    """The result of one scan.

    Attributes
    ----------
    scene, seed
        The scan; for a real one, `scene` is its path and `seed` is None.
    voxel_m
        Edge of the voxels with which the scan was thinned; 0 for the scan itself.
    points, kept
        Number of points that were measured, and their share of the scan.
    piles
        Its true piles.
    extras
        Its false piles.
    total
        All true piles together, and all measured ones; None without a true pile.
    failure
        Why the scan was not measured; None if it was.
    seconds
        Duration of the measurement.

    """

    scene: str
    seed: int | None
    voxel_m: float
    points: int
    kept: float
    piles: tuple[PileOutcome, ...]
    extras: tuple[Extra, ...]
    total: PileOutcome | None
    failure: str | None
    seconds: float

    @property
    def right(self) -> bool:
        """Whether every pile was found and there was no false pile."""
        return not self.extras and all(pile.volume_m3 is not None for pile in self.piles)

    @classmethod
    def from_json(cls, kept: dict[str, Any]) -> Outcome:
        """Return an outcome from the dict that `dataclasses.asdict` made of it."""
        parts = {
            "piles": tuple(PileOutcome(**pile) for pile in kept["piles"]),
            "extras": tuple(Extra(**extra) for extra in kept["extras"]),
            "total": None if kept["total"] is None else PileOutcome(**kept["total"]),
        }
        return cls(**{**kept, **parts})
