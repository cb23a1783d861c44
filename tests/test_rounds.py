"""Rounds: their order, what is kept of them, and that an interruption loses nothing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest

from divespot import DivespotError
from divespot.evaluate import rounds
from divespot.evaluate.rounds import KEPT, run_rounds

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    Work = Callable[[Any], dict[str, Any]]


@dataclass(frozen=True)
class Square:
    side: int


def area(square: Square) -> dict[str, Any]:
    return {"area": square.side**2}


def only_small(square: Square) -> dict[str, Any]:
    if square.side > 2:
        raise KeyboardInterrupt
    return area(square)


def never(_square: Square) -> dict[str, Any]:
    raise AssertionError


SQUARES = [Square(side) for side in (3, 1, 2)]
AREAS = [{"area": 9}, {"area": 1}, {"area": 4}]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_the_rounds(jobs: int) -> None:
    told: list[None] = []
    assert run_rounds(area, SQUARES, jobs=jobs, on_done=lambda: told.append(None)) == AREAS
    assert len(told) == 3


def test_no_round_gives_no_result(tmp_path: Path) -> None:
    assert run_rounds(area, [], jobs=2, folder=tmp_path) == []


def renamed(work: Work, monkeypatch: pytest.MonkeyPatch) -> Work:
    """Give another function the name of `area`, under which its rounds are kept."""
    monkeypatch.setattr(work, "__qualname__", area.__qualname__)
    return work


def test_kept_rounds_are_not_done_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_rounds(area, SQUARES, folder=tmp_path)
    assert run_rounds(renamed(never, monkeypatch), SQUARES, folder=tmp_path) == AREAS


def test_an_interruption_loses_no_finished_round(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(KeyboardInterrupt):
        run_rounds(renamed(only_small, monkeypatch), SQUARES[::-1], folder=tmp_path)
    kept = [json.loads(line) for line in (tmp_path / KEPT).read_text().splitlines() if line]
    assert [line["result"] for line in kept] == AREAS[:0:-1]
    # The next line was being written when the power went.
    with (tmp_path / KEPT).open("a") as file:
        file.write('{"round": "{')
    assert run_rounds(area, SQUARES, folder=tmp_path) == AREAS
    assert run_rounds(renamed(never, monkeypatch), SQUARES, folder=tmp_path) == AREAS


def test_another_build_does_them_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_rounds(area, SQUARES, folder=tmp_path)
    monkeypatch.setattr(rounds, "build", lambda: "another")
    with pytest.raises(AssertionError):
        run_rounds(renamed(never, monkeypatch), SQUARES, folder=tmp_path)


def test_jobs_must_be_some() -> None:
    with pytest.raises(DivespotError, match="jobs is 0: a whole number of 1 or more is needed"):
        run_rounds(area, SQUARES, jobs=0)
