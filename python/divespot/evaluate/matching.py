"""Matching measured piles with true ones."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from divespot.evaluate.outcome import Extra, PileOutcome
from divespot.simulate import FLYING, GROUND, STRAY, THING
from divespot.simulate.thing_solids import foot_z_m, solids_of
from divespot.simulate.things import Hanging

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from divespot.report import Pile, Report
    from divespot.simulate import SimulatedScan

#: An object is called floor if a smaller share of its points comes from anything else.
SOME = 0.2
NAMES_OF_LABELS = {FLYING: "flying pixels", STRAY: "outliers"}


def match(taken: SimulatedScan, report: Report | None) -> tuple[list[PileOutcome], list[Extra]]:
    """Match the piles of a report with the true ones; without a report, none was found.

    A measured pile matches the true one on which its centroid lies. Of several on the same pile the
    largest counts; the others are extras, and so are those whose centroid lies on no pile.

    Returns
    -------
    piles
        The true piles in the scene's order.
    extras
        The other measured piles, in the report's order.

    """
    if report is None:
        return [PileOutcome(truth_m3) for truth_m3 in taken.volumes_m3], []
    owners = _owners(taken, report.piles)
    best = {owner: i for i, owner in reversed(list(enumerate(owners))) if owner > 0}
    reasons = dict(zip(_owners(taken, report.other_objects), report.other_objects, strict=True))
    piles = []
    for number, truth_m3 in enumerate(taken.volumes_m3, start=1):
        if number in best:
            found = report.piles[best[number]]
            piles.append(_outcome(truth_m3, found))
        else:
            other = reasons.get(number)
            piles.append(PileOutcome(truth_m3, instead=None if other is None else other.reason))
    extras = [
        Extra(_part_of(taken, owners[i]) or what_is_at(taken, pile), pile.volume_m3)
        for i, pile in enumerate(report.piles)
        if i not in best.values()
    ]
    return piles, extras


def one_pile(taken: SimulatedScan, report: Report | None) -> tuple[list[PileOutcome], list[Extra]]:
    """Match the only object of a report, whether pile or not, with the largest pile.

    For methods that measure one object, as in the paper.
    """
    objects = (*report.piles, *report.other_objects) if report else ()
    if not taken.volumes_m3:
        return [], [Extra(what_is_at(taken, found), found.volume_m3) for found in objects]
    truth_m3 = max(taken.volumes_m3)
    if not objects:
        return [PileOutcome(truth_m3)], []
    found = max(objects, key=lambda item: item.volume_m3)
    return [_outcome(truth_m3, found)], []


def _outcome(truth_m3: float, found: Pile) -> PileOutcome:
    return PileOutcome(truth_m3, found.volume_m3, found.u95_m3, repeat_m3=found.repeat_m3)


def _owners(taken: SimulatedScan, found: Sequence[Pile]) -> list[int]:
    """Return the number of the true pile under each centroid; 0 for none.

    Objects without volume have no centroid.
    """
    at = taken.in_scene(np.array([pile.centroid_m for pile in found]).reshape(-1, 3))
    known = np.isfinite(at).all(axis=1)
    owners = np.zeros(len(at), dtype=np.int16)
    owners[known] = taken.surface.owner_at(*at[known, :2].T)
    return owners.tolist()


def _part_of(taken: SimulatedScan, owner: int) -> str | None:
    return f"part of pile {owner} of {len(taken.volumes_m3)}" if owner else None


def what_is_at(taken: SimulatedScan, found: Pile) -> str:
    """Return what the points in the middle of a measured pile come from."""
    place = taken.in_scene(np.array(found.centroid_m))
    points = taken.in_scene()
    radius_m = np.sqrt(found.footprint_m2 / np.pi)
    with np.errstate(invalid="ignore"):
        near = np.hypot(*(points[:, :2] - place[:2]).T) < radius_m
    labels = taken.labels[near]
    others = labels[labels != GROUND]
    if len(others) < SOME * len(labels) or not len(others):
        return "floor"
    label, counts = np.unique(others, return_counts=True)
    most = int(label[counts.argmax()])
    if most == THING:
        return _thing_at(taken, points[near][labels == THING])
    return NAMES_OF_LABELS.get(most, f"beside pile {most}")


def _thing_at(taken: SimulatedScan, points: NDArray[np.float64]) -> str:
    """Return the kind of the object that covers most of the points in plan."""
    covered: dict[str, int] = {}
    for thing in taken.scene.things:
        for frame in range(taken.scene.camera.frames):
            for solid in solids_of(thing, frame, foot_z_m(thing, frame, taken.surface)):
                count = int(solid.covers(points[:, 0], points[:, 1]).sum())
                name = thing.what if isinstance(thing, Hanging) else type(thing).__name__.lower()
                covered[name] = max(covered.get(name, 0), count)
    return max(covered, key=lambda name: covered[name])
