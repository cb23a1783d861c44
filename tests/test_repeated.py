"""Repeated measurements of slightly changed scans."""

from __future__ import annotations

import numpy as np
import pytest

import divespot
from divespot import simulate
from divespot.evaluate import evaluate
from divespot.evaluate.outcome import PileOutcome
from divespot.repeated import STABLE, _unstable, _volume_m3


def test_a_clean_pile_is_stable() -> None:
    points = simulate.scan("shape-05", density=0.05).points
    report = divespot.measure(points, repeat=True)
    plain = divespot.measure(points)
    (pile,) = report.piles
    assert (pile.volume_m3, pile.u95_m3) == (plain.piles[0].volume_m3, plain.piles[0].u95_m3)
    assert pile.repeat_m3 is not None
    assert 0.0 < pile.repeat_m3 < STABLE * pile.u95_m3
    assert plain.piles[0].repeat_m3 is None
    assert not [text for text in report.warnings if "not stable" in text]
    assert {"another seed", "1% fewer points", "every point twice"} <= set(report.timings_s)


def test_every_point_twice_is_every_point_once() -> None:
    points = simulate.scan("over-rain", seed=7, density=0.1).points
    once = divespot.measure(points).piles
    thrice = divespot.measure(np.concatenate([points] * 3)).piles
    assert len(once) == len(thrice)
    for one, other in zip(once, thrice, strict=True):
        assert abs(one.volume_m3 - other.volume_m3) < 0.1 * one.u95_m3


def test_what_changes_is_told_with_what_changed_it() -> None:
    (pile,) = divespot.measure(simulate.scan("shape-05", density=0.05).points).piles
    changes = {"another seed": 0.1 * pile.u95_m3, "1% fewer points": 0.5 * pile.u95_m3}
    (text,) = _unstable(pile, changes)
    assert text.startswith("pile 1 is not stable: with 1% fewer points its volume changes by")
    assert text.endswith("0.5 of its u95")
    assert not list(_unstable(pile, {"another seed": 0.3 * pile.u95_m3}))


def test_a_pile_that_is_gone_has_no_volume() -> None:
    (pile,) = divespot.measure(simulate.scan("shape-05", density=0.05).points).piles
    assert _volume_m3(pile, ()) == 0.0
    assert _volume_m3(pile, (pile,)) == pile.volume_m3


def test_inside_an_outline_it_is_the_same_outline_that_counts() -> None:
    points = simulate.scan("shape-05", density=0.05).points
    (pile,) = divespot.measure(points, inside=(-2.0, -2.0, 2.0, 2.0), up="z", repeat=True).piles
    assert pile.repeat_m3 is not None
    assert pile.repeat_m3 < pile.u95_m3


def test_an_evaluation_tells_how_many_are_stable() -> None:
    found = evaluate(["three-piles"], seeds=1, density=0.1, repeat=True)
    summary = found.summaries()["three-piles"]
    assert summary.piles.stable == pytest.approx(1.0)
    assert PileOutcome(1.0, 1.0, 0.1).stable is None
    assert PileOutcome(1.0, 1.0, 0.1, repeat_m3=0.05).stable is False
