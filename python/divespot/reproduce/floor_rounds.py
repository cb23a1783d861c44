"""One scan from frames, and its floor after each step of the registration."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot import _native
from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.frames.fusing import ONE_FRAME
from divespot.frames.intrinsics import Intrinsics
from divespot.frames.placing import View, place
from divespot.frames.source import Frames
from divespot.kernels import ground_height, height_histogram
from divespot.pipeline import measure
from divespot.reproduce.from_frames import VOXEL_PIXELS, onto
from divespot.reproduce.grounds import FINE, UNEVEN
from divespot.reproduce.staging import staged
from divespot.simulate import frames

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from divespot.settings import Settings
    from divespot.simulate import SimulatedFrames

    Matrices = NDArray[np.float64]

#: Steps of the registration, by their names in the JSON.
STEPS: Mapping[str, str] = MappingProxyType(
    {
        "true": "true poses",
        "chained": "each on the one before",
        "placed": "each on all before",
        "solved": "solved for together",
    }
)
#: Methods: the paper's with its two rules for the ground, and the instrument.
SETTINGS: Mapping[str, Settings] = MappingProxyType({n: v.settings for n, v in UNEVEN.items()})
#: Height of a bin; in wider ones the plateaus would be one peak.
BIN_M: float = FINE["bin_m"]
#: Heights within this of the exact floor belong to it: four times the frames' errors.
FLOOR_M = 0.06
#: A peak counts if it reaches this share of the highest, as in the paper's midpoint.
PEAK_SHARE = 0.5


@dataclass(frozen=True)
class FloorRound:
    """A scan of a changed shape, from the frames of its rail."""

    floor_of: str
    stage: str
    seed: int
    repeat: int
    density: float

    def result(self) -> dict[str, Any]:
        """Return the floor after each step; None if a frame cannot be registered."""
        options: Any = {"seed": self.seed, "repeat": self.repeat, "density": self.density}
        taken = frames(staged(self.floor_of, self.seed, self.stage), **options)
        view = View.of(Frames.of(taken.depth), Intrinsics.of(taken.matrix), "planar", 1)
        found = place(view)
        placed = found.tracker.poses()
        joint = found.solve()
        as_measured = [0.0] * len(view)
        steps: dict[str, tuple[Sequence[Any], Sequence[float]]] = {
            "true": (list(taken.poses), as_measured),
            "chained": (_chained(view), as_measured),
            "placed": (placed, as_measured),
            "solved": (joint.poses, joint.offsets_m),
        }
        return {
            name: None
            if any(pose is None for pose in poses)
            else _Step(view, joint, _where_true(poses, taken), offsets_m).found(taken)
            for name, (poses, offsets_m) in steps.items()
        }


def _chained(view: View) -> list[Matrices | None]:
    """Register each frame to the previous one only."""
    cutter = _native.RawCutter(view.threads)
    cut = [cutter.cut(*view.frame(number)) for number in range(len(view))]
    poses: list[Matrices | None] = [np.eye(4)]
    for before, now in pairwise(cut):
        step, last = _between(before, now, view.threads), poses[-1]
        poses.append(None if step is None or last is None else last @ step)
    return poses


def _between(before: _native.RawPatches, now: _native.RawPatches, threads: int) -> Matrices | None:
    tracker = _native.RawTracker(threads)
    for patches in (before, now):
        tracker.add(patches, None, exact=False)
    first, second = tracker.poses()
    if first is None or second is None:
        return None
    return np.linalg.solve(*(np.array([*pose, [0.0, 0.0, 0.0, 1.0]]) for pose in (first, second)))


def _where_true(poses: Sequence[Any], taken: SimulatedFrames) -> Matrices:
    """Return the poses, moved as a whole to the true camera positions, with the floor at 0."""
    found = np.array([np.array(pose)[:3] for pose in poses])
    rotation, shift_m = onto(found, taken.poses)
    turned: Matrices = rotation @ found
    turned[:, :, 3] += shift_m
    return turned


@dataclass(frozen=True, eq=False)
class _Step:
    """Frames with poses, and the offset added to their ranges."""

    view: View
    joint: _native.RawJoint
    poses: Matrices
    offsets_m: Sequence[float]

    def found(self, taken: SimulatedFrames) -> dict[str, Any]:
        """Return the floor's levels, the ground by the paper's rules, and the volume errors."""
        numbers = range(len(self.view))
        points = self.points(numbers, VOXEL_PIXELS)
        levels = [_ground(self.points([number], ONE_FRAME), "lower") for number in numbers]
        return {
            **_levels(points[np.abs(points[:, 2]) < FLOOR_M, 2]),
            "frames_m": levels,
            "apart_m": max(levels) - min(levels),
            "ground_m": {
                "peak": _ground(points, "lower"),
                "midpoint": _ground(points, "midpoint"),
            },
            "errors": {name: _error(points, taken, s) for name, s in SETTINGS.items()},
        }

    def points(self, numbers: Sequence[int], wide: float) -> NDArray[np.float64]:
        """Return the fused points of some of the frames."""
        fusion = self.view.fusion(self.joint, None, wide)
        for number in numbers:
            pose: Any = self.poses[number].tolist()
            fusion.add(*self.view.frame(number), pose, self.offsets_m[number])
        return fusion.points()[0]


def _ground(points: NDArray[np.float64], rule: Any) -> float:  # noqa: ANN401 - a literal
    """Return the ground height of all points by a rule of the paper."""
    return ground_height(points[:, 2], rule=rule, **FINE)


def _levels(heights_m: NDArray[np.float64]) -> dict[str, Any]:
    """Return the peaks and the width of the floor's histogram."""
    histogram = height_histogram(heights_m, **FINE)
    shares = histogram.smoothed / histogram.smoothed.max()
    signal = extra("scipy.signal", "reproduce", "the peaks of a histogram need SciPy")
    peaks = signal.find_peaks(np.pad(shares, 1), height=PEAK_SHARE)[0] - 1
    high_m, tops_m = histogram.centers_m[shares >= PEAK_SHARE], histogram.centers_m[peaks]
    return {
        "peaks": len(peaks),
        "spacing_m": float(np.diff(tops_m).mean()) if len(peaks) > 1 else None,
        "width_m": float(np.ptp(high_m)) + BIN_M,
        "histogram": {
            "heights_mm": np.round(1000.0 * histogram.centers_m, 2).tolist(),
            "shares": np.round(shares, 4).tolist(),
        },
    }


def _error(points: NDArray[np.float64], taken: SimulatedFrames, settings: Settings) -> float:
    """Return the relative error of the pile; -1 if it was not found."""
    try:
        report = measure(points, settings)
    except DivespotError:
        return -1.0
    is_one = settings.stages.select == "largest"
    objects = (*report.piles, *report.other_objects) if is_one else report.piles[:1]
    return sum(pile.volume_m3 for pile in objects) / taken.volume_m3 - 1.0
