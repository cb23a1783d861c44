"""Output of a report: text, notebooks, JSON and back, data frames, files, logging."""

from __future__ import annotations

import dataclasses
import importlib
import json
import logging
import math
import pkgutil
import subprocess
import sys
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Report
from divespot import io as dio
from divespot.cli import main
from divespot.simulate import scan
from reports import objects

if TYPE_CHECKING:
    from pathlib import Path

    from click.testing import Result


@cache
def points() -> Any:  # noqa: ANN401
    return scan("three-piles", density=0.1).points


@cache
def measured() -> Report:
    return divespot.measure(
        points(), material="corn", compare_bases=True, crop=(-9, -9, -9, 9, 9, 9)
    )


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


def test_a_report_is_told_in_a_few_lines() -> None:
    lines = repr(measured()).splitlines()
    assert len(lines) == 5
    assert "an array" in lines[0]
    assert "3 piles" in lines[0]
    assert lines[1].startswith("  pile 1: 0.03")
    assert lines[-1].startswith("  total: 0.07")
    many = dataclasses.replace(measured(), piles=measured().piles * 30)
    assert len(repr(many).splitlines()) < 20
    assert "0 piles" in repr(dataclasses.replace(measured(), piles=()))


def test_a_notebook_shows_a_picture_and_a_table(monkeypatch: pytest.MonkeyPatch) -> None:
    odd = dataclasses.replace(measured().piles[0], name="<b>&bay")
    html = dataclasses.replace(measured(), piles=(odd,))._repr_html_()
    assert "&lt;b&gt;&amp;bay" in html
    assert "<b>" not in html
    assert html.count("<img") == 1
    assert f"{odd.mass_kg:.2f}" in html
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert "<img" not in measured()._repr_html_()
    assert "pile 3" in measured()._repr_html_()


# JSON and back


def test_a_report_comes_back_from_its_json() -> None:
    back = Report.from_json(measured().to_json())
    assert back == measured()
    assert back.to_json() == measured().to_json()
    line = json.dumps({"time": "2026-01-01", **measured().to_dict()})
    assert Report.from_json(line.encode()) == measured()
    assert repr(back) == repr(measured())
    assert "pile 3" in back._repr_html_()
    with pytest.raises(DivespotError, match="a measured one is needed"):
        back.plot()


def test_what_is_null_comes_back_as_what_it_was() -> None:
    odd = dataclasses.replace(measured().piles[0], u95_m3=math.nan, mass_kg=None, name="a")
    back = Report.from_json(dataclasses.replace(measured(), piles=(odd,)).to_json()).piles[0]
    assert math.isnan(back.u95_m3)
    assert back.mass_kg is None
    assert back.name == "a"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"schema": "divespot.error/1"}',
        '{"schema": "divespot.report/1"}',
        '{"schema": "divespot.report/1", "settings": {"depth": 1}}',
        '{"schema": "divespot.report/1", "settings": {}, "source": 3}',
        "[" * 100_000,
    ],
)
def test_what_is_no_report_is_refused(text: str) -> None:
    with pytest.raises(DivespotError, match="report"):
        Report.from_json(text)


# Data frames


def test_a_data_frame_has_a_row_an_object(monkeypatch: pytest.MonkeyPatch) -> None:
    columns: dict[str, list[Any]] = {}
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "polars", SimpleNamespace(DataFrame=columns.update))
    measured().to_dataframe()
    assert columns["volume_m3"] == [item.volume_m3 for item in objects(measured())]
    assert columns["centroid_y"] == [item.centroid_m[1] for item in objects(measured())]
    assert columns["budget_noise_m3"] == [item.budget.noise_m3 for item in objects(measured())]
    assert columns["above_plane_m3"][0] > 0
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(DivespotError, match="one is needed for a data frame"):
        measured().to_dataframe()


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_a_data_frame_of_a_real_library(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip(library)
    if library == "polars":
        monkeypatch.setitem(sys.modules, "pandas", None)
    frame = measured().to_dataframe()
    assert list(frame["volume_m3"]) == [item.volume_m3 for item in objects(measured())]


# Files by their ending


@pytest.mark.parametrize("ending", [".json", ".csv", ".geojson", ".png"])
def test_a_report_is_saved_as_its_ending_says(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    for _ in range(2):
        measured().save(path)
    assert path.stat().st_size > 500
    path.write_bytes(b"precious")
    with pytest.raises(DivespotError, match="--force"):
        measured().save(path)
    assert path.read_bytes() == b"precious"
    measured().save(path, force=True)
    assert path.read_bytes() != b"precious"


def test_other_endings_and_what_was_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DivespotError, match=r"\.json, \.csv"):
        measured().save(tmp_path / "a.docx")
    path = tmp_path / "scan.csv"
    dio.write(tmp_path / "scan.xyz", points()[np.isfinite(points()).all(axis=1)])
    (tmp_path / "scan.xyz").rename(path)
    report = divespot.measure(path)
    with pytest.raises(DivespotError, match="would overwrite an input"):
        report.save(path, force=True)


# Comparing


def test_no_dataclass_compares_its_arrays() -> None:
    for module in pkgutil.walk_packages(divespot.__path__, "divespot."):
        if module.name.endswith(("__main__", "_native")):
            continue
        for kind in vars(importlib.import_module(module.name)).values():
            if isinstance(kind, type) and dataclasses.is_dataclass(kind):
                arrays = any("NDArray" in str(item.type) for item in dataclasses.fields(kind))
                assert not (arrays and kind.__dataclass_params__.eq), kind  # type: ignore[attr-defined]
    report = measured()
    assert report.level == report.level
    assert report == dataclasses.replace(report)
    assert report.level.height_map != dataclasses.replace(report.level.height_map)


# What is logged


def test_stages_and_warnings_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, logger="divespot"):
        report = divespot.measure(points(), density_kg_m3=700.0)
    told = [record.message for record in caplog.records]
    assert [text.split(":")[0] for text in told[: len(report.timings_s)]] == list(report.timings_s)
    warned = [r.message for r in caplog.records if r.levelno == logging.WARNING]
    assert warned == list(report.warnings)
    assert any("density was taken as exact" in text for text in warned)


def test_nothing_is_logged_unasked(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", points())
    code = (
        "import sys, divespot\n"
        f"divespot.measure({str(tmp_path / 'a.npy')!r}, density_kg_m3=7)\n"
        "print('logging' in sys.modules, file=sys.stderr)\n"
        f"import logging; divespot.measure({str(tmp_path / 'a.npy')!r}, density_kg_m3=7)"
    )
    done = subprocess.run(  # noqa: S603 - our own code
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == ""
    assert done.stderr in ("True\n", "False\n")


def test_loud_and_quiet(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    np.save(path, points())
    loud = run("measure", path, "-v")
    assert "divespot: pose: " in loud.stderr
    assert loud.stderr.count("does not state its unit") == 1
    logging.getLogger("divespot").handlers.clear()
    logging.getLogger("divespot").setLevel(logging.NOTSET)
    quiet = run("measure", path, "-q", "--csv", tmp_path / "a.csv")
    assert (quiet.exit_code, quiet.output) == (0, "")
    assert (tmp_path / "a.csv").exists()
    assert "cannot be read" in run("measure", tmp_path / "none.npy", "-q").stderr
    assert run("-V").stdout == run("--version").stdout
