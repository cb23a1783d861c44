"""Kinds of scenes that went wrong in the field: each pile with its volume, nothing else one."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import DivespotError, Report, _native
from divespot.settings import Settings
from kinds import KINDS, UTM, Floats, Kind
from solids import turned

if TYPE_CHECKING:
    from numpy.typing import NDArray

SEED = 7
#: A volume with an uncertainty of this share and more is none that somebody would rely on.
NONE_SHARE = 0.3


@cache
def made(name: str) -> Kind:
    return KINDS[name](np.random.default_rng([SEED, *name.encode()]))


@cache
def measured(name: str) -> Report:
    return divespot.measure(made(name).points)


def with_volumes() -> list[str]:
    return [name for name in KINDS if made(name).truth_m3 is not None]


@pytest.mark.parametrize("name", with_volumes())
def test_each_pile_has_its_volume_and_nothing_else_is_one(name: str) -> None:
    truth = sorted(made(name).truth_m3 or (), reverse=True)
    piles = measured(name).piles
    assert len(piles) == len(truth)
    for pile, volume in zip(piles, truth, strict=True):
        assert abs(pile.volume_m3 - volume) <= max(0.01 * volume, pile.u95_m3)
        assert pile.u95_m3 < 0.1 * volume


@pytest.mark.parametrize("name", [name for name in KINDS if made(name).truth_m3 is None])
def test_no_volume_is_claimed_where_none_can_be_told(name: str) -> None:
    try:
        report = measured(name)
    except DivespotError as error:
        assert "\n" not in str(error)  # noqa: PT017 - the only error there may be
        return
    assert report.warnings
    assert all(pile.u95_m3 >= NONE_SHARE * pile.volume_m3 for pile in report.piles)


def test_what_is_over_a_pile_is_listed_with_a_reason() -> None:
    for name in ("hovering", "standing", "belt", "bars"):
        reasons = {other.reason for other in measured(name).other_objects}
        assert reasons <= {"floating", "apart from the ground", "steep sides", "thin"}
        assert reasons, name


def _shuffled(points: Floats) -> tuple[Floats, NDArray[np.intp]]:
    order = np.random.default_rng(SEED).permutation(len(points))
    return points[order], order


def _on_surface(points: Floats, threads: int) -> NDArray[np.bool_]:
    anywhere = False
    is_on, _, _ = _native.surface_and_clusters(points, 0.02, 0.001, anywhere, 0.05, None, threads)
    return is_on


def test_neither_order_nor_threads_change_what_lies_on_the_surface() -> None:
    points = made("standing").points
    mask = _on_surface(points, 1)
    assert 0.7 < mask.mean() < 0.97
    shuffled, order = _shuffled(points)
    for threads in (1, 2, 5):
        assert np.array_equal(_on_surface(points, threads), mask)
        again = _on_surface(shuffled, threads)
        assert np.array_equal(again, mask[order])


def _said(report: Report) -> dict[str, object]:
    said = json.loads(report.to_json())
    del said["timings_s"], said["settings"]
    return dict(said)


def test_neither_order_nor_threads_change_the_report() -> None:
    points = made("standing").points
    one = divespot.measure(points, threads=1)
    other = divespot.measure(_shuffled(points)[0], threads=3)
    assert asdict(one.piles[0]) == asdict(other.piles[0])
    assert _said(one) == _said(other)


@pytest.mark.parametrize("name", ["standing", "terrace", "dock"])
def test_neither_shift_nor_turn_changes_a_volume(name: str) -> None:
    points = made(name).points
    pivot = points.mean(axis=0)
    moved = [points + UTM, *(turned(points - pivot, deg) + pivot for deg in (33, 90, 141))]
    for other in moved:
        report = divespot.measure(other)
        for pile, same in zip(report.piles, measured(name).piles, strict=True):
            assert abs(pile.volume_m3 - same.volume_m3) <= same.u95_m3 / 3


def test_the_paper_takes_every_point_for_the_surface() -> None:
    hung = divespot.measure(made("hovering").points, Settings.paper())
    assert not any(other.reason == "floating" for other in hung.other_objects)
