"""One simulated scan, measured with all settings that the experiments need."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError
from divespot.evaluate.matching import match
from divespot.evaluate.outcome import PileOutcome
from divespot.kernels import voxel_downsample
from divespot.pipeline import measure
from divespot.reproduce.staging import staged
from divespot.settings import Settings
from divespot.simulate import scan

if TYPE_CHECKING:
    from divespot.report import Report
    from divespot.simulate import SimulatedScan

# Scans are measured in parallel, with one thread each; results do not depend on the threads.
OURS = Settings(threads=1)
PAPER = Settings.paper(threads=1)


@dataclass(frozen=True)
class Scan:
    """A scan of a scene with one pile, unchanged or changed by a stage."""

    scene: str
    seed: int
    repeat: int
    density: float
    stage: str = "as it is"

    def take(self) -> SimulatedScan:
        """Simulate the scan."""
        scene = staged(self.scene, self.seed, self.stage)
        return scan(scene, seed=self.seed, repeat=self.repeat, density=self.density)


@dataclass(frozen=True)
class Variant:
    """How a scan is measured: thinned with voxels of an edge, unless 0, and with settings."""

    name: str
    settings: Settings
    voxel_m: float = 0.0


@dataclass(frozen=True)
class Measurement:
    """The result: the pile, and the share of the scan's points that were left."""

    pile: PileOutcome
    points: int
    kept: float


@dataclass(frozen=True)
class ScanRound:
    """A scan and its variants."""

    scan: Scan
    variants: tuple[Variant, ...]

    def result(self) -> dict[str, Any]:
        """Simulate and measure."""
        taken = self.scan.take()
        found = {one.name: _measured(taken, one) for one in self.variants}
        return {name: dataclasses.asdict(one) for name, one in found.items()}


def _measured(taken: SimulatedScan, variant: Variant) -> Measurement:
    points = taken.points
    if variant.voxel_m > 0.0:
        points = voxel_downsample(points, variant.voxel_m, threads=1)
    try:
        report: Report | None = measure(points, variant.settings)
    except DivespotError:
        report = None  # no volume: an error of 100 %
    pile = estimate(taken, report, variant.settings)
    return Measurement(pile, len(points), len(points) / len(taken.points))


def estimate(taken: SimulatedScan, report: Report | None, settings: Settings) -> PileOutcome:
    """Return the measurement of the only pile of a scan.

    If one object is measured, as in the paper, or objects are not separated, everything measured
    is taken as the pile.
    """
    stages = settings.stages
    if report is not None and (stages.select == "largest" or not stages.fine_cluster):
        objects = (*report.piles, *report.other_objects)
        if not objects:
            return PileOutcome(taken.volume_m3)
        volume = sum(item.volume_m3 for item in objects)
        return PileOutcome(taken.volume_m3, volume, sum(item.u95_m3 for item in objects))
    return match(taken, report)[0][0]
