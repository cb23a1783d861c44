"""The 18 shapes from depth frames, and how each step of the registration changes the error."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.frames import fuse
from divespot.frames.intrinsics import Intrinsics
from divespot.frames.placing import View, place
from divespot.frames.source import Frames
from divespot.pipeline import measure
from divespot.reproduce import paper
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Section, Table, counted, cubic, percent
from divespot.reproduce.scans import OURS
from divespot.simulate import frames
from divespot.simulate.shapes import ROWS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from divespot.intake import Scannable
    from divespot.reproduce.found import Found
    from divespot.reproduce.plan import Plan
    from divespot.simulate import SimulatedFrames

#: Steps of the registration, by their names in the JSON.
STEPS: Mapping[str, str] = MappingProxyType(
    {
        "true": "true poses, ranges as measured",
        "placed": "placed one by one",
        "solved": "solved for together",
    }
)
#: Edge of the voxels in which frames are added up, in pixels.
VOXEL_PIXELS = 2.0


@dataclass(frozen=True)
class FramesRound:
    """One shape from its frames."""

    scene: str
    seed: int
    repeat: int
    density: float

    def result(self) -> dict[str, Any]:
        """Simulate, fuse after each step, and measure."""
        options: Any = {"seed": self.seed, "repeat": self.repeat, "density": self.density}
        taken = frames(self.scene, **options)
        scan = fuse(taken.depth, taken.matrix, threads=1)
        found = scan.registration
        solved = _error(scan, taken)
        within = solved is not None and abs(solved[0]) <= solved[1]
        errors = {"solved": solved and solved[0], **_at_poses(taken)}
        poses = [] if found is None else [pose for pose in found.poses if pose is not None]
        return {
            "truth_m3": taken.volume_m3,
            "errors": errors,
            "within_u95": within,
            "position_m": off_m(poses, taken.poses) if len(poses) == len(taken.poses) else None,
            "offset_m": None if found is None else found.offset_m,
        }


def _error(scan: Scannable, taken: SimulatedFrames) -> tuple[float, float] | None:
    """Return the relative error of the pile and its u95; None if none was found."""
    try:
        pile = measure(scan, OURS).piles[0]
    except (DivespotError, IndexError):
        return None
    return pile.volume_m3 / taken.volume_m3 - 1.0, pile.u95_m3 / taken.volume_m3


def _at_poses(taken: SimulatedFrames) -> dict[str, float | None]:
    """Return the errors with true poses, and with those of frames registered one by one."""
    view = View.of(Frames.of(taken.depth), Intrinsics.of(taken.matrix), "planar", 1)
    found = place(view)
    placed = found.tracker.poses()
    joint = found.solve()
    true = [pose[:3].tolist() for pose in taken.poses]
    errors: dict[str, float | None] = {}
    for name, poses in (("true", true), ("placed", placed)):
        fusion = view.fusion(joint, None, VOXEL_PIXELS)
        for number, pose in enumerate(poses):
            if pose is not None:
                fusion.add(*view.frame(number), pose, 0.0)
        error = _error(fusion.points()[0], taken)
        errors[name] = error and error[0]
    return errors


def onto(
    found: Sequence[NDArray[np.float64]] | NDArray[np.float64],
    true: Sequence[NDArray[np.float64]] | NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotation and the shift that move cameras as a whole to their true places."""
    ours, theirs = np.array(found), np.array(true)
    u, _, v = np.linalg.svd(np.einsum("nij,nkj->ik", theirs[:, :3, :3], ours[:, :3, :3]))
    rotation = u @ v
    middle, there = (poses[:, :3, 3].mean(axis=0) for poses in (ours, theirs))
    return rotation, there - rotation @ middle


def off_m(
    found: Sequence[NDArray[np.float64]], true: Sequence[NDArray[np.float64]] | NDArray[np.float64]
) -> float:
    """Return the largest distance of a camera from its true position, aligned as a whole."""
    rotation, shift_m = onto(found, true)
    off = np.array(found)[:, :3, 3] @ rotation.T + shift_m - np.array(true)[:, :3, 3]
    return float(np.linalg.norm(off, axis=1).max())


def rounds(plan: Plan) -> list[FramesRound]:
    """Return every shape `side_rounds` times."""
    return [
        FramesRound(name, plan.seed, repeat, plan.density)
        for name in ROWS
        for repeat in range(plan.side_rounds)
    ]


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    results = {one: found.results[one] for one in rounds(plan)}
    rows = [_row(name, [r for one, r in results.items() if one.scene == name]) for name in ROWS]
    return Section(
        "From depth frames",
        [_told(plan), _table(rows)],
        {"rows": rows},
        _findings(rows),
    )


def _row(name: str, results: list[dict[str, Any]]) -> dict[str, Any]:
    errors = {
        step: [1.0 if r["errors"][step] is None else abs(r["errors"][step]) for r in results]
        for step in STEPS
    }
    positions = [r["position_m"] for r in results if r["position_m"] is not None]
    return {
        "shape": name,
        "truth_m3": results[0]["truth_m3"],
        "mean_error": {step: statistics.fmean(values) for step, values in errors.items()},
        "largest_error": {step: max(values) for step, values in errors.items()},
        "coverage": statistics.fmean(r["within_u95"] for r in results),
        "position_m": max(positions, default=None),
    }


def _told(plan: Plan) -> str:
    return (
        f"Each shape is seen in the frames of its rail, {counted(plan.side_rounds, 'time')}; no "
        "poses are given. With true poses the ranges are as the camera measures them, about 4 mm "
        "too long; placed one by one, each frame was registered to the earlier ones, as general "
        "registration does; solved for together, poses, the ranges' offset and the floor are "
        "adjusted to each other. Errors are those of `Settings()`; `position` is the largest error "
        "of a camera's position."
    )


def _table(rows: list[dict[str, Any]]) -> Table:
    header = ("shape", "true m³", *STEPS.values(), "held", "position mm", "paper")
    texts = tuple(
        (
            str(number),
            cubic(row["truth_m3"]),
            *(percent(row["mean_error"][step]) for step in STEPS),
            percent(row["coverage"]),
            "-" if row["position_m"] is None else f"{1e3 * row['position_m']:.2f}",
            percent(error),
        )
        for number, (row, (_, error)) in enumerate(zip(rows, paper.SHAPES, strict=True), start=1)
    )
    return Table(header, texts)


def _findings(rows: list[dict[str, Any]]) -> list[Finding]:
    mean = {step: statistics.fmean(row["mean_error"][step] for row in rows) for step in STEPS}
    largest = max(row["largest_error"]["solved"] for row in rows)
    return [
        Finding(
            "from frames, without poses, the mean error is at most 0.3 % and the largest 1 %",
            mean["solved"] <= 0.003 and largest <= 0.01,
            f"{percent(mean['solved'])}, {percent(largest)}",
        ),
        Finding(
            "the joint solution is better than placing frames one by one",
            mean["solved"] < mean["placed"],
            f"{percent(mean['solved'])} against {percent(mean['placed'])}",
        ),
    ]


EXPERIMENT = Experiment("from_frames", section, rounds=rounds)
