"""CSV, outlines with attributes, and the units of the table."""

from __future__ import annotations

import csv
import dataclasses
import json
import os
import re
from datetime import datetime
from functools import cache
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Report
from divespot import io as dio
from divespot.cli import main
from divespot.results.crs_name import crs_name
from divespot.results.csv_rows import COLUMNS, NO_PILE, save_csv
from divespot.results.outlines import save_outlines
from divespot.results.show_units import KG_PER_T, VOLUMES, Shown
from divespot.simulate import scan

if TYPE_CHECKING:
    from pathlib import Path

    from click.testing import Result

WKT = 'PROJCS["ETRS89 / UTM 32N",GEOGCS["x",AUTHORITY["EPSG","4258"]]'


@cache
def points() -> Any:  # noqa: ANN401
    return scan("three-piles", density=0.1).points


@cache
def measured() -> Report:
    return divespot.measure(points(), material="corn")


@pytest.fixture
def heaps(tmp_path: Path) -> Path:
    path = tmp_path / "heaps.ply"
    dio.write(path, points()[np.isfinite(points()).all(axis=1)])
    return path


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


# A row a pile


def test_a_row_holds_the_pile_to_the_last_digit(tmp_path: Path) -> None:
    save_csv(measured(), tmp_path / "a.csv")
    found = rows(tmp_path / "a.csv")
    assert len(found) == 3
    for row, pile in zip(found, measured().piles, strict=True):
        assert tuple(row) == COLUMNS
        for name in ("volume_m3", "u95_m3", "cut_m3", "mass_kg", "footprint_m2", "max_height_m"):
            assert float(row[name]) == getattr(pile, name)
        assert [float(row[f"centroid_{axis}"]) for axis in "xyz"] == list(pile.centroid_m)
        assert (row["pile"], row["material"]) == (str(pile.id), "corn")
        assert datetime.fromisoformat(row["time"]).utcoffset() is not None


def test_rows_are_added_below_one_header_or_take_the_place_of_old_ones(
    tmp_path: Path, heaps: Path
) -> None:
    out = tmp_path / "log.csv"
    for count in (3, 6):
        assert run("measure", heaps, "--csv", out, "--append").exit_code == 0
        assert len(rows(out)) == count
    assert run("measure", heaps, heaps, "--csv", out).exit_code == 0
    assert len(rows(out)) == 6
    assert run("measure", heaps, "--csv", out).exit_code == 0
    assert len(rows(out)) == 3


def test_what_cannot_be_measured_and_what_is_empty_have_a_row_too(
    tmp_path: Path, heaps: Path
) -> None:
    out, bad = tmp_path / "log.csv", tmp_path / 'none, "here".ply'
    assert run("measure", bad, heaps, "--csv", out).exit_code == 1
    first, *others = rows(out)
    assert first["scan"] == str(bad)
    assert "cannot be read" in first["remarks"]
    assert len(others) == 3
    save_csv(dataclasses.replace(measured(), piles=()), out)
    (row,) = rows(out)
    assert row["remarks"] == NO_PILE
    assert row["volume_m3"] == ""


def test_other_columns_are_not_added_to(tmp_path: Path) -> None:
    out = tmp_path / "log.csv"
    out.write_text("time,scan,scan_unit,other\n")
    with pytest.raises(DivespotError, match="other columns"):
        save_csv(measured(), out, append=True)
    assert out.read_text() == "time,scan,scan_unit,other\n"
    save_csv(measured(), out)
    assert len(rows(out)) == 3


# Outlines with attributes


def test_outlines_have_the_piles_figures_and_give_the_same_piles(
    tmp_path: Path, heaps: Path
) -> None:
    out = tmp_path / "out.geojson"
    done = run("measure", heaps, "--geojson", out, "--json", "-", "--material", "corn")
    piles = json.loads(done.stdout)["piles"]
    found = json.loads(out.read_text(encoding="utf-8"))
    assert found["scan"] == str(heaps)
    assert found["scan_unit"] == "m"
    assert "crs" not in found
    for feature, pile in zip(found["features"], piles, strict=True):
        told = feature["properties"]
        assert told.pop("material") == "corn"
        assert told.pop("pile") == pile["id"]
        assert told == {name: pile[name] for name in told}
        assert {"volume_m3", "u95_m3", "cut_m3", "fill_m3", "mass_kg"} <= set(told)
        (line,) = feature["geometry"]["coordinates"]
        assert line[:-1] == pile["outline_m"]
        assert line[0] == line[-1]
    again = json.loads(run("measure", heaps, "--outline", out, "--json", "-").stdout)["piles"]
    for one, other in zip(again, piles, strict=True):
        assert one["volume_m3"] == pytest.approx(other["volume_m3"], rel=0.03)


def test_the_coordinate_system_is_named_where_it_has_a_code(tmp_path: Path) -> None:
    for text, code in (
        ("EPSG:25832", 25832),
        (WKT + ',AUTHORITY["EPSG","25832"]]', 25832),
        (WKT + "]", None),
    ):
        source = dataclasses.replace(measured().source, crs=text)
        save_outlines(dataclasses.replace(measured(), source=source), tmp_path / "a.geojson")
        found = json.loads((tmp_path / "a.geojson").read_text(encoding="utf-8"))
        named = found.get("crs", {}).get("properties", {}).get("name")
        assert named == (None if code is None else f"urn:ogc:def:crs:EPSG::{code}")
        assert found["scan_crs"] == ("ETRS89 / UTM 32N" if code is None else f"EPSG:{code}")


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (None, None),
        ("", None),
        ("local grid", "local grid"),
        ('PROJCRS["a",ID["EPSG",31467]]', "EPSG:31467"),
    ],
)
def test_short_names(text: str | None, name: str | None) -> None:
    assert crs_name(text) == name


# Units


@pytest.mark.parametrize(
    ("name", "of_a_cubic_metre"),
    [("m3", 1.0), ("yd3", 1.3079506), ("L", 1000.0), ("bu", 28.377593)],
)
def test_units_are_those_of_the_tables(name: str, of_a_cubic_metre: float) -> None:
    assert VOLUMES[name][1] == pytest.approx(of_a_cubic_metre, rel=1e-7)


@pytest.mark.parametrize("unit", [*VOLUMES, "t"])
def test_the_table_is_in_the_unit_that_was_asked_for(unit: str, heaps: Path) -> None:
    table = run("measure", heaps, "--show-unit", unit, "--material", "corn").stdout
    report = divespot.measure(heaps, material="corn")
    shown = Shown.of(report, unit)
    assert f"net {shown.header}" in table
    for title, item in (("pile 1", report.piles[0]), ("total", report.total)):
        mass_kg = item.mass_kg or 0.0
        value = mass_kg / KG_PER_T if unit == "t" else item.volume_m3 * shown.per_m3
        (number,) = re.findall(rf"^{title} +([\d.]+) ±", table, re.MULTILINE)
        assert float(number) == pytest.approx(value, rel=0.01)


def test_cut_and_fill_stand_beside_the_net(heaps: Path) -> None:
    table = run("measure", heaps, "--show-unit", "L").stdout
    numbers = re.search(r"^pile 1 +([\d.]+) ± [\d.]+ +([\d.]+) +([\d.]+)", table, re.MULTILINE)
    assert numbers is not None
    net, cut, fill = map(float, numbers.groups())
    assert net == pytest.approx(cut - fill, abs=0.11)


def test_tonnes_need_a_density(heaps: Path) -> None:
    refused = run("measure", heaps, "--show-unit", "t")
    assert refused.exit_code == 2
    assert "--density" in refused.stderr
    with pytest.raises(DivespotError, match="density"):
        Shown.of(divespot.measure(heaps), "t")
    assert run("measure", heaps, "--show-unit", "pint").exit_code == 2


# Names


@pytest.mark.skipif(os.name == "nt", reason="file names are text there")
def test_names_that_are_no_text_cost_nothing(heaps: Path, tmp_path: Path) -> None:
    odd = os.fsencode(tmp_path / "scan") + b"\xff\x1b.ply"
    os.link(heaps, odd)
    name = os.fsdecode(odd)
    outputs = ["--csv", "a.csv", "--geojson", "a.geojson", "--history", "a.db", "--json", "a.json"]
    if all(find_spec(extra) for extra in ("jinja2", "matplotlib", "plotly")):
        outputs += ["--report", "a.html"]
    placed = [part if part.startswith("--") else str(tmp_path / part) for part in outputs]
    done = run("measure", name, *placed)
    assert done.exit_code == 0, done.stderr
    assert len(rows(tmp_path / "a.csv")) == 3
    named = dataclasses.replace(measured().piles[0], name="\ud800")
    save_csv(dataclasses.replace(measured(), piles=(named,)), tmp_path / "b.csv")
    assert rows(tmp_path / "b.csv")[0]["name"] == "?"
