"""What came of one scan, beside the truth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from divespot.repeated import STABLE


@dataclass(frozen=True)
class PileOutcome:
    """A true pile, and what was measured of it.

    Attributes
    ----------
    truth_m3
        Its true volume.
    volume_m3, u95_m3
        The measured volume and its expanded uncertainty; None if no pile was found there.
    instead
        Why what was found there is called no pile; None if a pile was found, or nothing at all.
    repeat_m3
        How much the volume changed when the scan was measured again a little otherwise; None if
        it was not.

    """

    truth_m3: float
    volume_m3: float | None = None
    u95_m3: float | None = None
    instead: str | None = None
    repeat_m3: float | None = None

    @property
    def error(self) -> float:
        """Relative error; that of a pile that was not found is -1."""
        return (self.volume_m3 or 0.0) / self.truth_m3 - 1.0

    @property
    def covered(self) -> bool:
        """Whether the truth lies within the expanded uncertainty."""
        if self.volume_m3 is None or self.u95_m3 is None:
            return False
        return abs(self.volume_m3 - self.truth_m3) <= self.u95_m3

    @property
    def stable(self) -> bool | None:
        """Whether it changed by a third of its u95 at most; None if that was not tried."""
        if self.repeat_m3 is None or self.u95_m3 is None:
            return None
        return self.repeat_m3 <= STABLE * self.u95_m3


@dataclass(frozen=True)
class Extra:
    """Something else that was called a pile: what it is in truth, and the volume it was given."""

    what: str
    volume_m3: float


@dataclass(frozen=True)
class Outcome:
    """One scan, measured.

    Attributes
    ----------
    scene, seed
        Which scan; a real one has its path for a scene, and no seed.
    voxel_m
        Edge of the voxels that the scan was thinned with; 0 for the scan as it is.
    points, kept
        Number of points that were measured, and the share of the scan that they are.
    piles
        Its true piles.
    extras
        What else was called a pile.
    total
        All true piles together, and all that was called a pile; None without a true pile.
    failure
        Why nothing was measured; None if something was.
    seconds
        What the measurement took.

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
        """Whether every pile was found and nothing else was called one."""
        return not self.extras and all(pile.volume_m3 is not None for pile in self.piles)

    @classmethod
    def from_json(cls, kept: dict[str, Any]) -> Outcome:
        """Return what `dataclasses.asdict` took apart."""
        parts = {
            "piles": tuple(PileOutcome(**pile) for pile in kept["piles"]),
            "extras": tuple(Extra(**extra) for extra in kept["extras"]),
            "total": None if kept["total"] is None else PileOutcome(**kept["total"]),
        }
        return cls(**{**kept, **parts})
