"""The evaluation: who is matched with whom, what is counted, what is printed."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Settings
from divespot.cli import main
from divespot.evaluate import (
    ErrorStatistics,
    Evaluation,
    Extra,
    Outcome,
    PileOutcome,
    Summary,
    evaluate,
    goals,
    read_list,
)
from divespot.evaluate.evaluation import BODIES, SHAPES, VOXELS_M, kinds_of
from divespot.evaluate.given import given_with
from divespot.evaluate.goals import COMPRESSION, EACH_PILE, NO_PILE
from divespot.evaluate.matching import match
from divespot.io import write
from divespot.simulate import NAMES, Box, SimulatedScan, scan

if TYPE_CHECKING:
    from pathlib import Path

    from click.testing import Result

    from divespot.report import Report


@pytest.fixture(scope="module")
def three() -> SimulatedScan:
    return scan("three-piles", density=0.05)


@pytest.fixture(scope="module")
def report(three: SimulatedScan) -> Report:
    return divespot.measure(three.points)


def placed(report: Report, taken: SimulatedScan, *at: tuple[float, float, float]) -> Report:
    """Return a report with a pile of 1, 2, 3 ... m3 at each place in plan of the scene."""
    rotation, shift = taken.pose[:3, :3], taken.pose[:3, 3]
    piles = tuple(
        dataclasses.replace(
            report.piles[0],
            volume_m3=volume_m3,
            centroid_m=tuple(rotation @ [x, y, 0.0] + shift),
        )
        for x, y, volume_m3 in at
    )
    return dataclasses.replace(report, piles=piles, other_objects=())


def test_each_pile_meets_its_truth(three: SimulatedScan, report: Report) -> None:
    piles, extras = match(three, report)
    assert extras == []
    assert [pile.truth_m3 for pile in piles] == list(three.volumes_m3)
    assert all(abs(pile.error) < 0.05 for pile in piles)
    # The report has the largest first, the scene does not.
    assert [pile.volume_m3 for pile in piles] != [pile.volume_m3 for pile in report.piles]


def test_a_pile_nobody_found_is_missed_by_all_of_itself(
    three: SimulatedScan, report: Report
) -> None:
    found = placed(report, three, (-1.05, 0.0, 0.035), (1.05, 0.05, 0.022))
    (first, second, third), extras = match(three, found)
    assert first.error == pytest.approx(0, abs=1e-9)
    assert second == PileOutcome(three.volumes_m3[1])
    assert second.error == -1.0
    assert not second.covered
    assert third.volume_m3 == 0.022
    assert extras == []


def test_of_two_on_one_pile_the_larger_counts(three: SimulatedScan, report: Report) -> None:
    found = placed(report, three, (-1.0, 0.0, 0.03), (-1.1, 0.05, 0.004))
    piles, extras = match(three, found)
    assert [pile.volume_m3 for pile in piles] == [0.03, None, None]
    assert extras == [Extra("part of pile 1 of 3", 0.004)]


def test_what_lies_on_no_pile_is_extra_and_named(three: SimulatedScan, report: Report) -> None:
    box = next(thing for thing in three.scene.things if isinstance(thing, Box))
    found = placed(report, three, (*box.center_m, 0.01), (0.55, 0.45, 0.002))
    piles, extras = match(three, found)
    assert all(pile.volume_m3 is None for pile in piles)
    assert extras == [Extra("box", 0.01), Extra("floor", 0.002)]


def test_what_was_called_something_else_has_its_reason(
    three: SimulatedScan, report: Report
) -> None:
    found = placed(report, three, (0.1, -0.05, 0.014))
    other = dataclasses.replace(found.piles[0], reason="thin")
    piles, extras = match(three, dataclasses.replace(found, piles=(), other_objects=(other,)))
    assert [pile.instead for pile in piles] == [None, "thin", None]
    assert piles[1].volume_m3 is None
    assert extras == []


def test_positions_are_in_the_unit_of_the_scan(three: SimulatedScan) -> None:
    feet = dataclasses.replace(
        three, points=three.points / 0.3048, scene=dataclasses.replace(three.scene, unit_m=0.3048)
    )
    report = divespot.measure(feet.points, unit="ft")
    piles, _ = match(feet, report)
    assert all(abs(pile.error) < 0.05 for pile in piles)


def test_statistics_by_hand() -> None:
    volumes = [
        PileOutcome(1.0, 1.01, 0.02),
        PileOutcome(2.0, 1.94, 0.02),
        PileOutcome(4.0),
        PileOutcome(1.0, 1.0, 0.05),
    ]
    found = ErrorStatistics.of(volumes)
    assert found.count == 4
    assert found.mean_error == pytest.approx((0.01 + 0.03 + 1 + 0) / 4)
    assert found.largest_error == 1.0
    assert found.bias == pytest.approx((0.01 - 0.03 - 1 + 0) / 4)
    assert found.coverage == 0.5
    assert found.median_u95 == pytest.approx(0.02)
    assert ErrorStatistics.of([]) == ErrorStatistics(0, None, None, None, None, None)


def test_an_uncertainty_that_is_no_number_covers_nothing() -> None:
    assert not PileOutcome(1.0, 1.0, math.nan).covered


def outcome(scene: str, *piles: PileOutcome, **changes: object) -> Outcome:
    plain = Outcome(scene, 0, 0.0, 1000, 1.0, piles, (), piles[0] if piles else None, None, 0.1)
    return dataclasses.replace(plain, **changes)  # type: ignore[arg-type]


def test_outcomes_survive_json() -> None:
    one = outcome("bay", PileOutcome(1.0, 1.1, 0.2), extras=(Extra("box", 0.1),))
    assert Outcome.from_json(json.loads(json.dumps(dataclasses.asdict(one)))) == one


def test_a_summary_tells_what_went_wrong() -> None:
    good = outcome("bay", PileOutcome(1.0, 1.1, 0.2))
    summary = Summary.of(
        [
            good,
            dataclasses.replace(good, extras=(Extra("box", 0.1), Extra("box", 0.2))),
            outcome("bay", PileOutcome(1.0, instead="thin")),
            outcome("bay", PileOutcome(1.0), failure="no plane"),
        ]
    )
    assert (summary.scans, summary.right) == (4, 1)
    assert summary.extras == {"box": 2}
    assert summary.missed == {"thin": 1, "no object of its own": 1}
    assert summary.failures == {"no plane": 1}


def test_goals_are_judged_by_the_largest_error() -> None:
    def verdict(*errors: float) -> str:
        whole = tuple(outcome("bay", PileOutcome(1.0, 1 + error, 0.0)) for error in errors)
        found = {goal.what: goal for goal in goals(Evaluation(whole, (), ()))}
        return found["bay: each pile, largest error"].verdict

    assert verdict(0.02, -0.029) == "reached"
    assert verdict(0.0, -0.04) == "on average"
    assert verdict(0.02, -0.05) == "missed"


def test_coverage_needs_300_scans_with_a_pile() -> None:
    held, not_held = PileOutcome(1.0, 1.1, 0.2), PileOutcome(1.0, 1.3, 0.2)

    def verdicts(good: int, bad: int) -> set[str]:
        whole = (outcome("bay", held),) * good + (outcome("bay", not_held),) * bad
        found = goals(Evaluation((*whole, outcome("bare-floor")), (), ()))
        overall = ("u95 holds the truth, each pile", "u95 holds the truth, total")
        return {goal.verdict for goal in found if goal.what in overall}

    assert verdicts(285, 15) == {"reached"}
    assert verdicts(284, 15) == {"too few"}
    # An uncertainty that always holds is too large.
    assert verdicts(300, 0) == verdicts(270, 30) == {"missed"}


def test_a_kind_of_120_piles_has_a_coverage_of_its_own() -> None:
    held, not_held = PileOutcome(1.0, 1.1, 0.2), PileOutcome(1.0, 1.3, 0.2)

    def verdicts(good: int, bad: int) -> dict[str, str]:
        whole = (outcome("cut-face", held),) * good + (outcome("cut-face", not_held),) * bad
        return {goal.what: goal.verdict for goal in goals(Evaluation(whole, (), ()))}

    what = "u95 holds the truth, cut-face"
    assert verdicts(110, 10)[what] == "reached"
    assert verdicts(106, 14)[what] == verdicts(120, 0)[what] == "missed"
    assert what not in verdicts(110, 9)


def test_no_kind_is_to_be_worse_than_by_the_paper_s_method() -> None:
    whole = (outcome("cut-face", PileOutcome(1.0, 1.02, 0.2)),)
    for error, verdict in ((0.03, "reached"), (-0.01, "missed")):
        paper = (outcome("cut-face", PileOutcome(1.0, 1 + error, 0.2)),)
        found = {goal.what: goal for goal in goals(Evaluation(whole, (), (), paper))}
        assert found["cut-face: no worse than the paper"].verdict == verdict


def test_goals_name_scenes_that_are() -> None:
    assert {*EACH_PILE, *NO_PILE} <= set(NAMES)
    assert tuple(row.voxel_m for row in COMPRESSION) == VOXELS_M
    assert kinds_of("shape-17") == (SHAPES, "shapes, 5.2 m²")


@pytest.fixture(scope="module")
def tiny() -> Evaluation:
    return evaluate(["shape-16", "bare-*"], seeds=2, density=0.02)


def test_a_tiny_evaluation(tiny: Evaluation) -> None:
    assert [(one.scene, one.seed) for one in tiny.whole] == [
        ("shape-16", 0),
        ("shape-16", 1),
        ("bare-floor", 0),
        ("bare-floor", 1),
    ]
    assert [one.voxel_m for one in tiny.thinned] == 2 * list(VOXELS_M)
    shape, _, bare, _ = tiny.whole
    assert abs(shape.piles[0].error) < 0.05
    assert shape.total is not None
    assert shape.total.truth_m3 == pytest.approx(0.335)
    assert bare.piles == ()
    assert bare.total is None
    assert list(tiny.summaries()) == [SHAPES, "shapes, 5.2 m²", "bare-floor"]
    kept = [one.kept for one in tiny.thinned[:6]]
    assert kept == sorted(kept, reverse=True)
    assert kept[-1] < 0.05


def test_scans_differ_by_seed_and_are_the_same_again(tiny: Evaluation) -> None:
    again = evaluate(["bare-floor", "shape-16"], seeds=1, first_seed=1, density=0.02)
    untimed = [dataclasses.replace(one, seconds=0.0) for one in (*tiny.whole, *again.whole)]
    first, second, _, bare, bare_again, second_again = untimed
    assert (bare_again, second_again) == (bare, second)
    assert first.piles[0].volume_m3 != second.piles[0].volume_m3


def test_scenes_drawn_at_random_are_scanned_more_often() -> None:
    found = evaluate(["varied-tilted", "over-lamp", "body-01"], seeds=1, density=0.005)
    assert [one.seed for one in found.whole] == [0, 1, 2, 3, 0, 1, 2, 3, 0]
    # Kinds of several scenes come last.
    assert found.kinds() == ["varied-tilted", "over-lamp", BODIES, "varied-*", "over-*"]
    assert found.summaries()["over-*"] == found.summaries()["over-lamp"]


def test_a_vessel_is_measured_with_its_floor_and_outline() -> None:
    one = scan("vessel-truck", seed=1, density=0.02)
    assert one.scene.vessel is not None
    given: Any = given_with(one)
    (ring,) = given["outline"]["coordinates"]
    assert set(given) == {"outline", "base", "up"}
    corners_m = one.in_scene(np.array(ring))
    np.testing.assert_allclose(corners_m[:-1, :2], one.scene.vessel.outline_m, atol=1e-9)
    assert float(given["base"].removeprefix("height=")) == pytest.approx(ring[0][2])
    found = evaluate(["vessel-truck"], seeds=1, density=0.02)
    assert all(abs(one.piles[0].error) < 0.2 for one in found.whole)
    assert given_with(scan("shape-01", density=0.01)) == {}


def test_a_failure_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: object, settings: Settings) -> None:
        raise DivespotError(f"{settings.outline is not None}: no outline is needed")

    monkeypatch.setattr("divespot.evaluate.simulated.measure", refuse)
    found = evaluate(["vessel-bin"], seeds=1, density=0.005, paper=True)
    assert {one.failure for one in found.whole} == {"True: no outline is needed"}
    assert found.paper == ()


def test_every_family_has_kinds() -> None:
    assert kinds_of("levels-pit-alone") == ("levels-pit-alone", "levels-*")
    assert kinds_of("cut-face") == ("cut-face",)
    assert kinds_of("body-18") == (BODIES,)
    assert kinds_of("three-piles") == ("three-piles",)


def test_the_paper_s_method_measures_one_object_of_the_same_scans() -> None:
    found = evaluate(["three-piles", "bare-floor"], seeds=1, density=0.05, paper=True)
    three, bare = found.paper
    (pile,) = three.piles
    assert pile.truth_m3 == 0.035
    # It lacks the toe below its margin.
    assert -0.25 < pile.error < -0.01
    assert three.points == found.whole[0].points
    assert bare.piles == ()
    assert found.paper_of_kind("three-piles").piles.count == 1
    assert evaluate(["bare-floor"], seeds=1, density=0.05).paper == ()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"scenes": ["bay", "sandpit"]}, "there is no scene 'sandpit': one of shape-01, .* needed"),
        ({"scenes": ["bay"], "seeds": 0}, "seeds is 0: a whole number of 1 or more is needed"),
        ({"scenes": ["bay"], "first_seed": -1}, "seed is -1"),
        ({"scenes": ["bay"], "density": 0.0}, "bay, seed 0: density is 0.0"),
    ],
)
def test_bad_input_is_named(arguments: dict[str, object], sentence: str) -> None:
    with pytest.raises(DivespotError, match=sentence):
        evaluate(**arguments)  # type: ignore[arg-type]


@pytest.fixture
def scans(tmp_path: Path, three: SimulatedScan) -> Path:
    """Return a list with a scan of three piles in millimetres."""
    write(tmp_path / "three.npy", 1000 * three.points)
    rows = [f"three.npy,{volume_m3},mm" for volume_m3 in three.volumes_m3]
    path = tmp_path / "list.csv"
    path.write_text("\n".join(["path,volume_m3,unit", *rows]))
    return path


def test_listed_scans_are_held_against_their_volumes(scans: Path) -> None:
    found = evaluate(scans=scans)
    assert found.whole == found.thinned == ()
    (one,) = found.real
    assert [pile.truth_m3 for pile in one.piles] == [0.035, 0.022, 0.014]
    assert all(abs(pile.error) < 0.05 for pile in one.piles)
    (goal,) = goals(found)
    assert (goal.what, goal.verdict) == ("real scans: largest error", "reached")


def test_a_listed_scan_that_cannot_be_measured_is_missed(tmp_path: Path) -> None:
    np.save(tmp_path / "few.npy", np.eye(3))
    (tmp_path / "list.csv").write_text("path,volume_m3\nfew.npy,2\n")
    (one,) = evaluate(scans=tmp_path / "list.csv").real
    assert one.failure is not None
    assert one.piles == (PileOutcome(2.0),)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "the file is empty"),
        ("path,volume_m3\n", "a header path,volume_m3 and one row per pile are needed"),
        ("file,volume_m3\nscan.npy,1\n", "line 2: there is no path: columns .* are needed"),
        ("path,volume_m3\nscan.npy\n", "line 2: there is no volume_m3"),
        ("path,volume_m3\nscan.npy,much\n", "volume_m3 is 'much': a number above 0 is needed"),
        ("path,volume_m3\nscan.npy,-1\n", "volume_m3 is '-1': a number above 0 is needed"),
        ("path,volume_m3\nother.npy,1\n", "line 2: there is no file .*other.npy"),
    ],
)
def test_bad_lists_are_named(tmp_path: Path, text: str, sentence: str) -> None:
    (tmp_path / "scan.npy").touch()
    (tmp_path / "list.csv").write_text(text)
    with pytest.raises(DivespotError, match=sentence):
        read_list(tmp_path / "list.csv", Settings())


def test_a_list_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DivespotError, match="a list of scans is needed"):
        read_list(tmp_path / "none.csv", Settings())


def command(*args: object) -> Result:
    return CliRunner().invoke(main, ["evaluate", *map(str, args)], prog_name="divespot")


TINY = ("--scenes", "shape-16,sharp-box", "--seeds", 1, "--density", 0.02, "--jobs", 1)


def test_the_command_prints_every_table(scans: Path) -> None:
    result = command(*TINY, "--paper", "--scans", scans)
    assert result.exit_code == 0, result.output
    for text in (
        "Errors of the piles in %",
        "`Settings()` beside `Settings.paper()`, in %",
        "18 shapes",
        "sharp-box",
        "all, total",
        "thinned",
        "29.4",  # the paper's error at 0.3 m
        "three.npy",
        "Goals",
        "18 shapes: mean error",
        "3 scans, seeds 0 to 0, and 6 thinned ones at density 0.02 in 0 min",
    ):
        assert text in result.stdout
    assert "…" not in result.stdout


def test_the_command_s_json_is_all_there_is(tmp_path: Path) -> None:
    result = command(*TINY, "--json", "-", "--out", tmp_path / "kept")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["schema"] == "divespot.evaluation/1"
    assert (found["seeds"], found["first_seed"], found["density"]) == (1, 0, 0.02)
    assert len(found["whole"]) == 2
    assert len(found["thinned"]) == 6
    assert found["real"] == []
    assert set(found["kinds"]) == {"18 shapes", "shapes, 5.2 m²", "sharp-box"}
    assert {"what", "wanted", "value", "verdict"} == set(found["goals"][0])
    # The same again, from what was kept.
    again = command(*TINY, "--json", "-", "--out", tmp_path / "kept")
    assert again.stdout == result.stdout


def test_the_command_names_bad_input() -> None:
    result = command("--scenes", "sandpit")
    assert result.exit_code == 1
    assert result.stderr.startswith("divespot: there is no scene 'sandpit'")
