"""What is written of a comparison: numbers equal the JSON's, and nothing is overwritten."""

from __future__ import annotations

import dataclasses
import json
from functools import cache
from html.parser import HTMLParser
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import Comparison, DivespotError
from divespot.cli import main
from divespot.results.change_document import ChangeDocument, Unit
from test_compare import scans

if TYPE_CHECKING:
    from pathlib import Path

for name in ("jinja2", "matplotlib", "typst"):
    pytest.importorskip(name, reason=f"the extra report is not installed: {name}")

AT = np.array([482_310.0, 5_456_790.0, 312.0])
NASTY = "</script><b>Yard & 3"


@cache
def compared() -> Comparison:
    before, after = (points + AT for points in scans())
    return divespot.compare(before, after, crs="EPSG:25832")


class Cells(HTMLParser):
    """Values of the cells of each table, and the JSON."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.values: dict[str, list[float]] = {}
        self.json = ""
        self._is_json = False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        self._is_json = known.get("id") == "report"
        if tag == "table":
            self._table = self.values.setdefault(str(known["id"]), [])
        if tag == "td" and known.get("data-value"):
            self._table.append(float(str(known["data-value"])))
        assert not (known.get("src") or known.get("href") or "#").startswith("http")

    def handle_data(self, data: str) -> None:
        if self._is_json:
            self.json += data


def test_the_page_has_the_numbers_of_the_json(tmp_path: Path) -> None:
    path = tmp_path / "change.html"
    compared().save(path, site=NASTY)
    html = path.read_text("utf-8")
    assert "&lt;/script&gt;&lt;b&gt;Yard &amp; 3" in html
    found = Cells(html)
    report = json.loads(found.json)
    assert report == json.loads(compared().to_json())
    assert found.values["total"] == [report[key]["volume_m3"] for key in ("gain", "loss", "net")]
    assert found.values["places"] == [
        value
        for place in report["places"]
        for value in (
            *(place["id"], place["gain_m3"], place["loss_m3"], place["net"]["volume_m3"]),
            *(place["detection_m3"], place["area_m2"]),
        )
    ]
    assert found.values["piles"] == [
        value
        for one in report["piles"]
        for value in (one["volume_before_m3"], one["volume_after_m3"], one["change"]["volume_m3"])
    ]


@pytest.mark.parametrize("ending", [".json", ".pdf", ".png", ".svg", ".html"])
def test_own_files_are_written_over_and_others_are_not(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"change{ending}"
    for _ in range(2):
        compared().save(path)
    assert path.stat().st_size > 5000
    path.write_text("mine")
    with pytest.raises(DivespotError, match="divespot did not write"):
        compared().save(path)
    compared().save(path, force=True)
    assert path.stat().st_size > 5000


def test_heights_of_both_surveys_give_the_change_back(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio", reason="the extra raster is not installed")
    path = tmp_path / "change.tif"
    compared().save(path)
    with rasterio.open(path) as raster:
        assert raster.descriptions == ("after", "before", "difference", "seen")
        assert raster.crs.to_epsg() == 25832
        after, before, difference, _ = raster.read()
        cell_m2 = abs(raster.transform.determinant)
    assert np.nanmax(np.abs(after - before - difference)) < 1e-4
    factor = compared().source.scale_factor or 1.0
    total = np.nansum(difference) * cell_m2 / factor**2
    assert total == pytest.approx(compared().net.volume_m3, abs=2 * compared().net.u95_m3)


def test_places_are_outlines_for_a_gis(tmp_path: Path) -> None:
    pyogrio = pytest.importorskip("pyogrio", reason="the extra gis is not installed")
    for ending in (".geojson", ".gpkg"):
        path = tmp_path / f"places{ending}"
        compared().save(path)
        about, _, _, columns = pyogrio.raw.read(path)
        found = dict(zip(about["fields"].tolist(), columns, strict=True))
        assert about["crs"] == "EPSG:25832"
        assert found["net_m3"].tolist() == [place.net.volume_m3 for place in compared().places]


def test_where_nothing_changed_the_page_says_so(tmp_path: Path) -> None:
    points = scans()[0]
    same = divespot.compare(points, points)
    assert same.net.is_none
    same.save(tmp_path / "a.pdf")
    assert same.plot().axes[0].get_title(loc="left") == "no change detected"
    doc = ChangeDocument.of(same, Unit.of(same))
    assert [cell.text for row in doc.total.rows for cell in row[1:]] == ["none detected"] * 2
    assert doc.trust.startswith("No change above the detection limit.")
    assert repr(same).endswith("0 places, 0 not counted>")
    lost = dataclasses.replace(same.fit, alignment=dataclasses.replace(same.alignment, blocks=0))
    unknown = ChangeDocument.of(dataclasses.replace(same, fit=lost), Unit.of(same))
    assert "Too little ground" in unknown.trust


def test_a_comparison_is_told_in_a_few_lines() -> None:
    told = repr(compared()).splitlines()
    assert told[0].startswith("<Comparison of an array and an array: 3 places, ")
    assert [line.split(":")[0].strip() for line in told[1:]] == ["gain", "loss", "net"]
    with pytest.raises(DivespotError, match="is needed as the ending of a comparison"):
        compared().save("a.xyz")


def test_one_command_writes_every_output(tmp_path: Path) -> None:
    for extra in ("rasterio", "pyogrio"):
        pytest.importorskip(extra)
    paths = [tmp_path / name for name in ("before.npy", "after.npy")]
    for path, points in zip(paths, scans(), strict=True):
        np.save(path, points)
    flags = ("--json", "--geojson", "--gpkg", "--dem", "--report", "--picture")
    endings = ("json", "geojson", "gpkg", "tif", "html", "png")
    outputs = {flag: f"a.{ending}" for flag, ending in zip(flags, endings, strict=True)}
    given = [str(part) for flag, name in outputs.items() for part in (flag, tmp_path / name)]
    words = ["compare", *map(str, paths), *given, "--site", "Yard", "--show-unit", "yd3"]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    assert all((tmp_path / name).stat().st_size > 1000 for name in outputs.values())
    assert "yd³" in (tmp_path / "a.html").read_text("utf-8")
    refused = CliRunner().invoke(main, ["compare", *map(str, paths), "--dem", str(paths[0])])
    assert refused.exit_code == 2
