"""The extent of a run: rounds, densities and sizes."""

from __future__ import annotations

from dataclasses import dataclass

from divespot._arguments import number, seed_number, whole
from divespot.errors import DivespotError


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The extent of a run of all experiments.

    Attributes
    ----------
    seed
        Seed of the piles and of all other random draws.
    rounds
        Number of scans of each of the 18 shapes, with fresh noise.
    side_rounds
        Number of scans of each shape in the other experiments.
    density
        Number of points of the scans of the shapes, relative to the scenes' own.
    side_density
        The same for the comparison of methods and of grounds.
    layers
        Sizes of the cone in the experiments on growth: its height in voxels.
    time_points
        Number of points of the scan for the running time.
    frames
        Whether the shapes, and floors made uneven by frame errors, are also simulated as depth
        frames, `side_rounds` times each.

    """

    seed: int = 0
    rounds: int = 50
    side_rounds: int = 10
    density: float = 1.0
    side_density: float = 1.0
    layers: tuple[int, ...] = (80, 100, 125, 160, 200, 250)
    time_points: int = 300_000
    frames: bool = False

    def __post_init__(self) -> None:
        for name in ("rounds", "side_rounds", "time_points"):
            whole(name, getattr(self, name))
        seed_number(self.seed)
        for name in ("density", "side_density"):
            number(name, getattr(self, name))
        if not 1 <= self.side_rounds <= self.rounds:
            raise DivespotError(
                f"rounds is {self.rounds} and side_rounds {self.side_rounds}: at least 1, and no "
                "more side rounds than rounds, are needed"
            )

    @classmethod
    def quick(cls, seed: int = 0, *, frames: bool = False) -> Plan:
        """Return a plan for a few minutes."""
        return cls(
            seed=seed,
            rounds=3,
            side_rounds=1,
            side_density=0.25,
            layers=(80, 100, 125, 160, 200),
            frames=frames,
        )

    @property
    def other_seed(self) -> int:
        """Seed of the piles that the compensation factor is calibrated on."""
        return self.seed + 1
