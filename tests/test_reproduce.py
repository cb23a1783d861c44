"""The reproduction: a tiny run of every experiment, its page, and the parts it is made of."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

from divespot import DivespotError
from divespot.cli import main
from divespot.evaluate.outcome import PileOutcome
from divespot.evaluate.rounds import KEPT
from divespot.reproduce import EXPERIMENTS, Plan, from_frames, paper, plateaus, reproduce
from divespot.reproduce.ablation import FIRST
from divespot.reproduce.found import Found
from divespot.reproduce.growth import exponent
from divespot.reproduce.html import html
from divespot.reproduce.page import Finding, Section, Table, page, percent
from divespot.reproduce.reproduction import experiments
from divespot.reproduce.scans import OURS, PAPER, Scan, ScanRound, Variant

if TYPE_CHECKING:
    from pathlib import Path

TINY = Plan(
    rounds=1,
    side_rounds=1,
    density=0.04,
    side_density=0.025,
    layers=(80, 100, 125),
    time_points=5000,
)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("reproduction")
    reproduce(out, TINY, jobs=2)
    return out


@pytest.fixture(scope="module")
def found(done: Path) -> dict[str, Any]:
    described = json.loads((done / "reproduce.json").read_text(encoding="utf-8"))
    assert described["schema"] == "divespot.reproduction/1"
    return dict(described["experiments"])


def test_every_experiment_is_on_the_page(done: Path, found: dict[str, Any]) -> None:
    text = (done / "reproduce.md").read_text(encoding="utf-8")
    markup = (done / "reproduce.html").read_text(encoding="utf-8")
    assert list(found) == [one.name for one in EXPERIMENTS]
    headings = [line.removeprefix("## ") for line in text.splitlines() if line.startswith("## ")]
    assert len(headings) == len(EXPERIMENTS) + 1
    assert headings[-1] == "Measured times"
    for heading in headings:
        assert f"<h2>{heading}</h2>" in markup
    assert markup.count("<table>") == sum(line.startswith("| :--") for line in text.splitlines())


def test_every_figure_is_there(done: Path) -> None:
    names = {path.stem for path in (done / "figures").iterdir()}
    assert names == {
        "shapes",
        "compression",
        "ablation",
        "slices",
        "alpha",
        "memory",
        "methods",
        "time",
    }
    text = (done / "reproduce.md").read_text(encoding="utf-8")
    for name in names:
        assert f"(figures/{name}.png)" in text
        assert (done / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_shapes(found: dict[str, Any]) -> None:
    rows = found["shapes"]["rows"]
    assert len(rows) == len(paper.SHAPES) == 18
    assert all(row["ours"]["mean_error"] < 0.02 for row in rows)
    ours, papers = (np.mean([row[key]["mean_error"] for row in rows]) for key in ("ours", "papers"))
    assert ours < papers
    assert all(0.9 < factor < 1.3 for factor in found["shapes"]["factors"].values())


def test_compression(found: dict[str, Any]) -> None:
    rows = found["compression"]["rows"]
    assert [row["voxel_m"] for row in rows] == list(paper.COMPRESSION)
    kept = [row["kept"] for row in rows]
    assert kept == sorted(kept, reverse=True)
    assert rows[0]["kept"] == 1
    assert rows[0]["ours"] < 0.01
    assert rows[-1]["ours"] > rows[0]["ours"]


def test_ablation(found: dict[str, Any]) -> None:
    error = {stage: row["paper"][0] for stage, row in found["ablation"]["rows"].items()}
    assert error["without both filters"] > error["whole method"]
    # Of so few points, the first filter cannot tell people from the heap below them.
    assert error["without pose correction"] > error["whole method"]
    assert error["without pose correction"] > error["without ground calibration"]


def test_the_first_filter_takes_the_people_away() -> None:
    scan = Scan("shape-17", 0, 0, 0.25, "leaning, people")
    changes: dict[str, Any] = {"whole": {}, "without": FIRST}
    variants = tuple(Variant(name, PAPER.tuned(**change)) for name, change in changes.items())
    result = ScanRound(scan, variants).result()
    whole, without = (PileOutcome(**result[name]["pile"]).error for name in changes)
    assert abs(whole) < 0.02
    assert abs(without) > 0.05


def test_methods(found: dict[str, Any]) -> None:
    for errors in found["methods"]["errors"].values():
        assert abs(errors["grid"]) < 0.02
        assert abs(errors["voxels"]) < 0.03
        assert errors["hull"] > errors["tin"]
        assert errors["convex"][0] < 0
        assert errors["convex"][-1] > 0.1
        assert errors["concave"][-1] < errors["convex"][-1] + 1e-9
        assert errors["alpha"] == sorted(errors["alpha"])
        assert errors["alpha"][0] < -0.5


def test_grounds(found: dict[str, Any]) -> None:
    small, floors = found["grounds"]["areas"]["1.3"], found["grounds"]["floors"]
    assert small["camera"] > 1.5 * small["peak"]
    assert small["local"] < small["camera"]
    assert floors["plateaus"]["peak"] > floors["as it is"]["peak"]


def test_memory_grows_with_the_cube_and_the_square(found: dict[str, Any]) -> None:
    assert found["growth"]["exponents"]["voxels"] == pytest.approx(3, abs=0.15)
    assert found["growth"]["exponents"]["grid"] == pytest.approx(2, abs=0.1)
    assert all(finding["holds"] for finding in found["growth"]["findings"])


def test_times_are_told_apart(done: Path) -> None:
    times = json.loads((done / "times.json").read_text(encoding="utf-8"))
    assert times["points"] == TINY.time_points
    assert "volume" in times["timings_s"]["default"]
    assert "seconds" not in (done / "reproduce.json").read_text(encoding="utf-8")


def test_nothing_is_done_twice(done: Path) -> None:
    before = {name: (done / name).read_bytes() for name in ("reproduce.md", "reproduce.html", KEPT)}
    picture = (done / "figures" / "slices.png").read_bytes()
    told: list[tuple[int, int]] = []
    reproduce(done, TINY, on_round=lambda now, of: told.append((now, of)))
    assert {name: (done / name).read_bytes() for name in before} == before
    assert (done / "figures" / "slices.png").read_bytes() == picture
    assert [now for now, _ in told] == list(range(1, told[0][1] + 1))


def test_a_round_repeats() -> None:
    variants = (Variant("default", OURS), Variant("paper", PAPER))
    one, other = (ScanRound(Scan("shape-02", 3, repeat, 0.03), variants) for repeat in (0, 1))
    assert one.result() == one.result()
    assert one.result() != other.result()
    truths = {result["default"]["pile"]["truth_m3"] for result in (one.result(), other.result())}
    assert len(truths) == 1  # the same pile, fresh noise


def test_a_fit_finds_its_exponent() -> None:
    sizes = [10.0, 20.0, 50.0]
    assert exponent(sizes, [7 * n**2.5 for n in sizes]) == pytest.approx(2.5)


def test_a_page_tells_what_does_not_hold() -> None:
    findings = [
        Finding("up is up", holds=True, figures="1 of 1"),
        Finding("down is up", holds=False, figures="0 %", why_not="It fell."),
    ]
    section = Section("Ways", [Table(("way", "m"), (("up", "1"),))], {}, findings)
    text = page("Title", "Words.", [section])
    assert "Of 2 findings and goals, 1 hold here." in text
    assert text.count("**Does not hold:** down is up (0 %). It fell.") == 2
    markup = html("Title", text)
    assert ">up</td>" in markup
    assert "<title>Title</title>" in markup


@pytest.mark.parametrize(("share", "text"), [(0.0203, "2.03 %"), (0.2618, "26.2 %"), (None, "-")])
def test_percent(share: float | None, text: str) -> None:
    assert percent(share) == text


@pytest.mark.parametrize("rounds", [(0, 0), (3, 4), (3, 0)])
def test_a_plan_needs_rounds(rounds: tuple[int, int]) -> None:
    with pytest.raises(DivespotError, match="no more side rounds than rounds"):
        Plan(rounds=rounds[0], side_rounds=rounds[1])


def test_shapes_from_frames_show_each_step_of_the_registration() -> None:
    plan = Plan(rounds=1, side_rounds=1, density=0.1, frames=True)
    assert experiments(plan)[-2] is from_frames.EXPERIMENT
    assert from_frames.EXPERIMENT not in experiments(TINY)
    asked = from_frames.rounds(plan)
    assert len(asked) == 18
    one = asked[4].result()
    assert abs(one["errors"]["solved"]) < 0.01
    assert one["position_m"] < 0.002
    assert set(one["errors"]) == set(from_frames.STEPS)
    section = from_frames.section(Found(dict.fromkeys(asked, one), {}), plan)
    assert section.findings[0].holds
    assert "| 18 |" in section.markdown()


def test_registration_closes_the_plateaus_of_a_floor() -> None:
    plan = Plan(seed=4, rounds=1, side_rounds=1, side_density=0.07, frames=True)
    assert experiments(plan)[-1] is plateaus.EXPERIMENT
    asked = plateaus.rounds(plan)
    assert len(asked) == 6
    one = next(r for r in asked if (r.floor_of, r.stage) == ("shape-05", "plateaus")).result()
    assert one["true"]["peaks"] > 1
    assert one["true"]["spacing_m"] > 0.002
    assert one["chained"]["apart_m"] < 0.5 * one["true"]["apart_m"]
    assert one["solved"]["peaks"] == 1
    assert abs(one["solved"]["ground_m"]["midpoint"]) < 0.002
    section = plateaus.section(Found(dict.fromkeys(asked, one), {}), plan)
    assert [picture.name for picture in section.pictures()] == ["plateaus"]
    assert "15 mm, each on the one before" in section.markdown()


def test_the_command_runs_its_plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def instead(out: str, plan: Plan, **running: Any) -> Path:  # noqa: ANN401
        asked.append((plan, running["jobs"]))
        return tmp_path / out / "reproduce.md"

    monkeypatch.setattr("divespot.reproduce.reproduce", instead)
    args = ["reproduce", "--quick", "--out", "here", "--jobs", "2", "--seed", "5"]
    result = CliRunner().invoke(main, args)
    assert result.exit_code == 0
    assert result.stdout.endswith("reproduce.md\n")
    assert asked == [(Plan.quick(5), 2)]
