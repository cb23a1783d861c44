"""The results of all rounds, for look-up by experiments."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from divespot.evaluate.outcome import PileOutcome
from divespot.evaluate.rounds import run_rounds
from divespot.reproduce.scans import Measurement, ScanRound

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from divespot.reproduce.scans import Scan, Variant

Need = tuple["Scan", "Variant"]


class Round(Protocol):
    """A frozen dataclass of plain values that computes its own result."""

    def result(self) -> dict[str, Any]:
        """Return the result."""
        ...


def carry_out(one: Round) -> dict[str, Any]:
    """Do the work of a round, for `run_rounds`."""
    return one.result()


@dataclass(frozen=True)
class Found:
    """The results of rounds."""

    results: Mapping[Round, dict[str, Any]]
    measurements: Mapping[tuple[Scan, str], Measurement]

    @classmethod
    def by(cls, rounds: list[Round], **running: Any) -> Found:  # noqa: ANN401 - those of run_rounds
        """Run the rounds."""
        results = dict(zip(rounds, run_rounds(carry_out, rounds, **running), strict=True))
        measurements = {
            (one.scan, name): Measurement(**{**kept, "pile": PileOutcome(**kept["pile"])})
            for one, result in results.items()
            if isinstance(one, ScanRound)
            for name, kept in result.items()
        }
        return cls(results, measurements)

    def measurement(self, need: Need) -> Measurement:
        """Return the result of a scan measured with one variant."""
        scan, variant = need
        return self.measurements[scan, variant.name]

    def piles(self, needs: Iterable[Need]) -> list[PileOutcome]:
        """Return the piles of several measurements."""
        return [self.measurement(need).pile for need in needs]


def merged(needs: Iterable[Need]) -> list[ScanRound]:
    """Return one round per scan with all its variants, since simulating a scan takes long."""
    wanted: dict[Scan, dict[str, Variant]] = {}
    for scan, variant in needs:
        wanted.setdefault(scan, {})[variant.name] = variant
    return [ScanRound(scan, tuple(variants.values())) for scan, variants in wanted.items()]
