"""A history of measurements in one file."""

from __future__ import annotations

import csv
import dataclasses
import json
import sqlite3
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Report
from divespot.cli import main
from divespot.results import history
from divespot.simulate import scan

if TYPE_CHECKING:
    from pathlib import Path

    from click.testing import Result


@cache
def points() -> Any:  # noqa: ANN401
    return scan("three-piles", density=0.05).points


@cache
def measured() -> Report:
    return divespot.measure(points(), material="corn")


def with_total(volume_m3: float) -> Report:
    return dataclasses.replace(
        measured(), total=dataclasses.replace(measured().total, volume_m3=volume_m3)
    )


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


def test_every_measurement_is_kept_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "site.db"
    assert history.add(measured(), path, site="bay", time="2026-01-02T00:00:00+00:00") == 1
    assert history.add(with_total(0.5), path, site="bay", time="2026-01-01T00:00:00+00:00") == 2
    assert history.add(measured(), path) == 3
    first, second = history.entries(path, "bay")
    assert (first.volume_m3, second.volume_m3) == (0.5, measured().total.volume_m3)
    assert Report.from_json(second.report) == measured()
    assert len(history.entries(path)) == 3
    assert history.past(path, "bay") == (first, second)
    assert history.past(tmp_path / "none.db") == ()


def test_piles_can_be_asked_for_with_sql(tmp_path: Path) -> None:
    path = tmp_path / "site.db"
    history.add(measured(), path)
    with sqlite3.connect(path) as base:
        rows = base.execute(
            "SELECT pile, volume_m3, centroid_z FROM piles ORDER BY pile"
        ).fetchall()
    base.close()
    assert rows == [(p.id, p.volume_m3, p.centroid_m[2]) for p in measured().piles]


def test_what_is_no_history_is_left_alone(tmp_path: Path) -> None:
    other, text = tmp_path / "other.db", tmp_path / "text.db"
    with sqlite3.connect(other) as base:
        base.execute("CREATE TABLE mine (a)")
    base.close()
    text.write_bytes(b"precious")
    np.save(tmp_path / "a.npy", points())
    for path in (other, text):
        before = path.read_bytes()
        with pytest.raises(DivespotError, match="divespot did not write"):
            history.add(measured(), path)
        with pytest.raises(DivespotError):
            history.entries(path)
        refused = run("measure", tmp_path / "a.npy", "--history", path)
        assert refused.exit_code == 1
        assert path.read_bytes() == before
    assert run("history", tmp_path / "none.db").exit_code == 1
    assert not (tmp_path / "none.db").exists()
    refused = run("measure", tmp_path / "a.npy", "--history", tmp_path / "a.npy")
    assert "would overwrite an input" in refused.stderr


def test_a_history_that_cannot_be_written_does_not_cost_the_rest(tmp_path: Path) -> None:
    path, out = tmp_path / "none" / "site.db", tmp_path / "out.json"
    np.save(tmp_path / "a.npy", points())
    done = run("measure", tmp_path / "a.npy", "--history", path, "--json", out)
    assert done.exit_code == 1
    assert "cannot be used" in done.stderr
    assert json.loads(out.read_text(encoding="utf-8"))["piles"]


def test_the_command_lists_exports_and_plots(tmp_path: Path) -> None:
    path, scan_path = tmp_path / "site.db", tmp_path / "a.npy"
    np.save(scan_path, points())
    for site in ("bay 1", "bay 1", "bay 2"):
        assert run("measure", scan_path, "--history", path, "--site", site).exit_code == 0
    listed = run("history", path, "--site", "bay 1")
    assert listed.exit_code == 0, listed.output
    assert listed.stdout.startswith("2 measurements")
    assert listed.stdout.count(" 0.0000 ± 0.0") == 1, "the change since the one before"
    out, picture = tmp_path / "out.csv", tmp_path / "out.png"
    assert run("history", path, "--csv", out).exit_code == 0
    with out.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 9
    report = divespot.measure(scan_path)
    assert {float(row["volume_m3"]) for row in rows} == {p.volume_m3 for p in report.piles}
    lines = [json.loads(line) for line in run("history", path, "--json", "-").stdout.splitlines()]
    assert [line["site"] for line in lines] == ["bay 1", "bay 1", "bay 2"]
    again = Report.from_json(json.dumps(lines[0]))
    assert dataclasses.replace(again, timings_s=report.timings_s) == report
    pytest.importorskip("matplotlib")
    assert run("history", path, "--picture", picture).exit_code == 0
    assert picture.stat().st_size > 5000
    assert run("history", path, "--picture", "a.gif").exit_code == 2
    assert run("history", path, "--csv", path).exit_code == 1
