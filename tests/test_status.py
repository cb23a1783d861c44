"""The status of a scan, one word for a supervisor."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot.cli import main
from divespot.errors import DivespotError, NoGroundError, NothingSeenError, Status
from divespot.simulate import scan

if TYPE_CHECKING:
    from collections.abc import Callable

    from click.testing import Result
    from numpy.typing import NDArray


def floor() -> NDArray[np.float64]:
    x, y = np.meshgrid(np.arange(0.0, 2.0, 0.02), np.arange(0.0, 2.0, 0.02))
    rng = np.random.default_rng(0)
    return np.column_stack([x.ravel() + 3.0, y.ravel(), rng.normal(0.0, 0.001, x.size)])


def ball() -> NDArray[np.float64]:
    directions = np.random.default_rng(0).normal(0.0, 1.0, (5000, 3))
    ranges = np.sqrt((directions**2).sum(axis=1))
    return np.asarray(directions / ranges[:, None] + 5.0)


SCANS: dict[str, Callable[[], NDArray[np.float64]]] = {
    "measured": lambda: scan("shape-05", density=0.03).points,
    "no_pile": floor,
    "no_ground": ball,
    "nothing_seen": lambda: np.zeros((100, 3)),
}


@pytest.fixture(scope="module")
def paths(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("scans")
    paths = {status: folder / f"{status} 1.npy" for status in SCANS}
    for status, points in SCANS.items():
        np.save(paths[status], points())
    paths["bad_input"] = folder / "no such.npy"
    return paths


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, ["measure", *map(str, args)], prog_name="divespot")


@pytest.mark.parametrize("status", [*SCANS, "bad_input"])
def test_a_line_tells_what_became_of_a_scan(paths: dict[str, Path], status: str) -> None:
    result = run(paths[status], "--status")
    assert result.exit_code == (0 if status in {"measured", "no_pile"} else 1)
    (line,) = result.stdout.splitlines()
    words = dict(word.split("=", 1) for word in shlex.split(line))
    assert words["status"] == status
    assert words["scan"] == str(paths[status])
    if result.exit_code == 0:
        assert int(words["piles"]) == (status == "measured")
        expected = divespot.measure(paths[status]).total
        assert float(words["volume_m3"]) == pytest.approx(expected.volume_m3, rel=1e-5)
        assert float(words["u95_m3"]) == pytest.approx(expected.u95_m3, rel=0.05)
    else:
        assert words["error"] in result.stderr


def test_json_lines_tell_it_too(paths: dict[str, Path]) -> None:
    result = run(*paths.values(), "--json", "-")
    assert [json.loads(line)["status"] for line in result.stdout.splitlines()] == list(paths)


def test_a_file_and_a_line(paths: dict[str, Path], tmp_path: Path) -> None:
    result = run(paths["measured"], "--status", "--json", tmp_path / "report.json")
    assert result.stdout.startswith("status=measured piles=1 ")
    assert json.loads((tmp_path / "report.json").read_text("utf-8"))["status"] == "measured"


def test_quiet_leaves_the_line_alone(paths: dict[str, Path]) -> None:
    result = run(paths["measured"], "--status", "--quiet")
    assert result.stdout.startswith("status=measured piles=1 ")
    assert not result.stderr


def test_standard_output_is_for_one_of_both(paths: dict[str, Path]) -> None:
    result = run(paths["measured"], "--status", "--json", "-")
    assert result.exit_code == 2
    assert "--status" in result.stderr


def test_errors_have_it_in_python() -> None:
    for points, kind in ((ball(), NoGroundError), (np.zeros((9, 3)), NothingSeenError)):
        with pytest.raises(DivespotError) as caught:
            divespot.measure(points)
        assert type(caught.value) is kind
    assert DivespotError("x").status == "bad_input"


def test_the_docs_name_every_status() -> None:
    edge = (Path(__file__).resolve().parents[1] / "docs" / "edge.md").read_text("utf-8")
    for status in get_args(Status):
        assert f"| `{status}` | " in edge
