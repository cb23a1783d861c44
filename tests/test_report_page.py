"""The page to be read and signed: its numbers, that it needs nothing else, and how it is drawn."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import shutil
import subprocess
import sys
import time
from functools import cache
from html.parser import HTMLParser
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError, Report
from divespot import io as dio
from divespot.cli import main
from divespot.results.document import Document, Survey
from divespot.results.history import Past
from divespot.results.html_report import html_report
from divespot.results.pdf_report import pdf_report
from divespot.results.scene3d import scene
from divespot.results.show_units import Shown
from divespot.results.trust import trust_sentence
from divespot.results.wording import texts
from divespot.simulate import scan
from test_change_report import compared

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

for name in ("jinja2", "matplotlib", "plotly", "typst"):
    pytest.importorskip(name, reason=f"the extra report is not installed: {name}")

MOST_BYTES = 5_000_000
NASTY = '</script><script>alert("1")</script>&{{ 7 * 7 }}'
PAST = (
    Past("2026-10-01T06:00:00+00:00", 0.05, 0.001),
    Past("2026-11-01T06:00:00+00:00", 0.06, 0.001),
)


@cache
def points() -> Any:  # noqa: ANN401
    return scan("three-piles", density=0.1).points


@cache
def measured() -> Report:
    report = divespot.measure(points(), material="corn")
    named = dataclasses.replace(report.piles[0], name=NASTY)
    return dataclasses.replace(report, piles=(named, *report.piles[1:]))


@cache
def page() -> str:
    return html_report(measured(), Survey("Yard <3>", "2026-11-26T08:30:00+00:00", PAST))


class Page(HTMLParser):
    """Texts of the cells with their values, and of the scripts by their id."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tables: dict[str, list[list[tuple[str, float | None]]]] = {}
        self.scripts: dict[str, str] = {}
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self._rows: list[list[tuple[str, float | None]]] = []
        self._into = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        self.tags.append((tag, known))
        self._into = tag
        if tag == "table":
            self._rows = self.tables.setdefault(str(known["id"]), [])
        elif tag == "tr":
            self._rows.append([])
        elif tag == "td":
            value = known.get("data-value")
            self._rows[-1].append(("", None if value is None else float(value)))
        elif tag == "script":
            self._script = str(known.get("id"))
            self.scripts[self._script] = ""

    def handle_data(self, data: str) -> None:
        if self._into == "td":
            text, value = self._rows[-1][-1]
            self._rows[-1][-1] = (text + data, value)
        elif self._into == "script":
            self.scripts[self._script] += data

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002 - the parser's call
        self._into = ""


def test_the_numbers_are_those_of_the_json() -> None:
    found = Page(page())
    report = json.loads(found.scripts["report"])
    assert report == json.loads(measured().to_json())
    _, *rows, total = found.tables["piles"]
    for row, pile in zip(rows, report["piles"], strict=True):
        values = [value for _, value in row if value is not None]
        named = ("id", "volume_m3", "mass_kg", "footprint_m2", "max_height_m", "seen_fraction")
        assert values == [pile[name] for name in named]
        # What is read is the number, as far as its digits go.
        text, value = row[2]
        read, _, u95 = text.partition(" ± ")
        assert float(read) == pytest.approx(value, abs=float(u95) / 10)
        assert float(u95) == pytest.approx(pile["u95_m3"], rel=0.06)
    assert [value for _, value in total if value is not None] == [
        report["total"]["volume_m3"],
        report["total"]["mass_kg"],
    ]
    others = [row[2][1] for row in found.tables["left-out"][1:]]
    assert others == [item["volume_m3"] for item in report["other_objects"]]


def test_a_page_needs_nothing_else_and_is_small() -> None:
    html = page()
    assert len(html.encode()) < MOST_BYTES
    for tag, attributes in Page(html).tags:
        for name in ("src", "href", "xlink:href", "srcset", "action"):
            value = attributes.get(name) or ""
            assert value.startswith(("#", "data:")) or not value, (tag, name, value[:80])
        assert tag not in {"iframe", "object", "embed", "base"}
        assert tag != "link" or attributes["rel"] == "icon"
    assert not re.search(r"@import|url\((?!#)", html.split("<body>")[0])


def test_what_users_name_cannot_break_the_page() -> None:
    html = page()
    assert "alert(" not in re.sub(r"(?s)<script type=.*?</script>", "", html).replace(
        "alert(&#34;", ""
    )
    assert "&lt;/script&gt;&lt;script&gt;alert(&#34;1&#34;)" in html
    assert "{{ 7 * 7 }}" in html
    assert "Yard &lt;3&gt;" in html
    drawn = [tag for tag, _ in Page(html).tags if tag == "script"]
    assert len(drawn) == 4


def test_a_page_holds_what_was_asked_of_it() -> None:
    html, report = page(), measured()
    for pile in report.piles:
        shown = Shown.of(report)
        label = f"{pile.id}: {shown.measured(pile)} {shown.unit}"
        assert label in html, "on the plan"
        assert label in {told["text"] for told in scene(report)["labels"]}, "in the view"
    for title in (
        "plan",
        "sections",
        "view",
        "uncertainty",
        "filled_title",
        "left_out",
        "settings",
    ):
        assert f"<h2>{texts()[title]}</h2>" in html
    assert html.count("along") >= len(report.piles)
    assert re.search(r"\+0\.011\d ± 0\.00\d+ m³ since 2026-11-01", html)
    assert "2026-11-26 08:30:00 UTC" in html
    assert divespot.__version__ in html
    for name in ("seed", "cell_m", "margin_m"):
        assert f"<dt>{name}</dt>" in html


def test_the_view_holds_the_surface() -> None:
    report = measured()
    found = scene(report)
    rows, columns = map(int, found["z"]["shape"].split(", "))
    assert max(rows, columns) <= 180
    assert len(found["x"]) == columns

    def values(name: str, kind: str) -> Any:  # noqa: ANN401
        import base64  # noqa: PLC0415

        return np.frombuffer(base64.b64decode(found[name]["bdata"]), kind).reshape(rows, columns)

    z, base, pile = values("z", "f4"), values("base", "f4"), values("pile", "u1")
    cell_m2 = float(np.diff(found["x"][:2])[0] * np.diff(found["y"][:2])[0])
    for item in report.piles:
        own = pile == item.id
        volume = float((z - base)[own].sum()) * cell_m2
        assert volume == pytest.approx(item.volume_m3, rel=0.05)
        assert own.sum() * cell_m2 == pytest.approx(item.footprint_m2, rel=0.5)
    assert found["labels"][0]["text"].startswith("1: ")


def test_the_file_s_hash_is_told(tmp_path: Path) -> None:
    path = tmp_path / "heaps.ply"
    dio.write(path, points()[np.isfinite(points()).all(axis=1)])
    document = Document.of(divespot.measure(path), Survey(), 12)
    told = dict(document.provenance)
    assert told["SHA-256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert document.title == "heaps"
    path.unlink()
    assert "no file" in dict(Document.of(measured(), Survey(), 12).provenance)["SHA-256"]


def test_a_report_from_json_has_a_page_without_drawings() -> None:
    html = html_report(Report.from_json(measured().to_json()))
    assert texts()["plan_none"] in html
    assert "<svg" not in html
    assert Page(html).tables["piles"]
    assert pdf_report(Report.from_json(measured().to_json())).startswith(b"%PDF")


def test_a_page_without_piles() -> None:
    x, y = np.meshgrid(np.arange(60) * 0.01, np.arange(60) * 0.01)
    z = np.random.default_rng(0).normal(0.0, 0.0005, x.shape)
    report = divespot.measure(np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    html = html_report(report)
    assert texts()["no_pile"] in html
    assert texts()["trust_none"] in html
    assert pdf_report(report).startswith(b"%PDF")


# One sentence


@pytest.mark.parametrize(
    ("share", "word"),
    [(0.01, "relied on"), (0.02, "sound"), (0.04, "fair"), (0.07, "rough"), (0.2, "estimate only")],
)
def test_the_sentence_follows_from_the_uncertainty(share: float, word: str) -> None:
    total = dataclasses.replace(measured().total, volume_m3=100.0, u95_m3=100.0 * share)
    report = dataclasses.replace(measured(), total=total)
    said = trust_sentence(report, Shown.of(report, "m3"), texts())
    assert said.startswith("This total")
    assert word in said.split(":")[0]
    assert f"{100 * share:.2g}" in said
    assert said.count(". ") == 0, "one sentence"


def test_the_sentence_says_what_else_to_know() -> None:
    first, *others = measured().piles
    odd = dataclasses.replace(first, touches_edge=True, seen_fraction=0.8)
    report = dataclasses.replace(
        measured(),
        piles=(odd, *others),
        warnings=("the scan does not state its unit: m was assumed",),
    )
    said = trust_sentence(report, Shown.of(report), texts())
    for part in (
        "the part of pile 1 beyond",
        "was not seen",
        "unit of the coordinates was assumed",
    ):
        assert part in said


# Texts


def test_all_texts_stand_in_one_file() -> None:
    folder = files("divespot.results").joinpath("templates")
    for file in ("report.html.j2", "report.typ"):
        used = set(re.findall(r"(?<![\w.])t\.(\w+)", folder.joinpath(file).read_text("utf-8")))
        assert used
        assert used <= set(texts()), file
    template = folder.joinpath("report.html.j2").read_text("utf-8")
    visible = re.sub(r"(?s)\{[%{].*?[%}]\}|<style>.*?</style>|<[^>]+>", "", template)
    assert re.findall(r"[A-Za-z]{2,}", visible) == []


# Files and the command line


def test_pages_are_written_by_the_command(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", points())
    for ending, begins in (("html", b"<!doctype html>"), ("pdf", b"%PDF")):
        out = tmp_path / f"a.{ending}"
        for _ in range(2 if ending == "pdf" else 1):  # the second time over its own
            done = CliRunner().invoke(
                main, ["measure", str(tmp_path / "a.npy"), "--report", str(out), "--site", "Bay 4"]
            )
            assert done.exit_code == 0, done.output
        assert out.read_bytes().startswith(begins)
        out.write_bytes(b"precious")
        refused = CliRunner().invoke(
            main, ["measure", str(tmp_path / "a.npy"), "--report", str(out)]
        )
        assert refused.exit_code == 1
        assert out.read_bytes() == b"precious"
    wrong = CliRunner().invoke(main, ["measure", str(tmp_path / "a.npy"), "--report", "a.doc"])
    assert wrong.exit_code == 2


@pytest.mark.parametrize(
    ("module", "ending"), [("jinja2", "html"), ("plotly", "html"), ("typst", "pdf")]
)
def test_what_is_not_installed_is_named(
    module: str, ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(DivespotError, match=r"pip install divespot\[report\]"):
        measured().save(tmp_path / f"a.{ending}")
    assert not list(tmp_path.iterdir())


def test_a_pdf_says_the_same(tmp_path: Path) -> None:
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext is not there (Debian: poppler-utils)")
    path = tmp_path / "a.pdf"
    path.write_bytes(pdf_report(measured(), Survey("Yard 3", past=PAST)))
    command = ["pdftotext", "-layout", str(path), "-"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout  # noqa: S603
    shown = Shown.of(measured())
    for pile in measured().piles:
        assert said.count(shown.measured(pile)) >= 2, "in the table and on the plan"
    assert shown.measured(measured().total) in said
    assert "Yard 3" in said
    assert texts()["signature"] in said
    assert "since 2026-11-01" in said
    assert said.count("\f") >= 2


# In a browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    webdriver = pytest.importorskip("selenium.webdriver")
    if not (shutil.which("chromium") and shutil.which("chromedriver")):
        pytest.skip("no browser to look at the page with (Debian: chromium, chromium-driver)")
    from selenium.webdriver.chrome.service import Service  # noqa: PLC0415 - an extra

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in ("headless=new", "no-sandbox", "use-angle=swiftshader", "window-size=700,600"):
        options.add_argument(f"--{argument}")
    options.add_argument("--enable-unsafe-swiftshader")
    options.add_argument("--disable-dev-shm-usage")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def test_a_browser_draws_the_page_without_errors(browser: Any, tmp_path: Path) -> None:  # noqa: ANN401
    path = tmp_path / "a.html"
    path.write_text(page(), encoding="utf-8")
    browser.get(path.as_uri())
    state = "return document.getElementById('view').dataset"
    until = time.monotonic() + 60
    while not browser.execute_script(state) and time.monotonic() < until:
        time.sleep(0.1)
    assert browser.execute_script(state) == {"ready": "true"}
    view = browser.find_element("id", "view")
    browser.execute_script("arguments[0].scrollIntoView()", view)
    pictures = []
    for button in ("[data-color=height]", "[data-color=pile]", "[data-color=seen]", "#base"):
        browser.find_element("css selector", button).click()
        time.sleep(0.3)
        pictures.append(view.screenshot_as_png)
    assert all(colors(picture) > 200 for picture in pictures), "the view draws pixels"
    assert len(set(pictures)) == len(pictures), "each button changes the view"
    errors = [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    assert errors == []
    asked = browser.execute_script(
        "return performance.getEntriesByType('resource').map(e => e.name)"
    )
    assert [name for name in asked if not name.startswith(("data:", "blob:"))] == []
    cells = browser.find_elements("css selector", "#piles tbody td[data-value]")
    shown = [float(cell.get_attribute("data-value")) for cell in cells]
    assert measured().piles[0].volume_m3 in shown


def test_a_browser_shows_what_changed_without_errors(browser: Any, tmp_path: Path) -> None:  # noqa: ANN401
    path = tmp_path / "change.html"
    compared().save(path)
    browser.get(path.as_uri())
    cells = browser.find_elements("css selector", "#total td[data-value]")
    shown = [float(cell.get_attribute("data-value")) for cell in cells]
    assert shown == [getattr(compared(), name).volume_m3 for name in ("gain", "loss", "net")]
    plan = browser.find_element("css selector", ".plan svg")
    browser.execute_script("arguments[0].scrollIntoView()", plan)
    assert colors(plan.screenshot_as_png) > 200
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
    assert browser.execute_script("return performance.getEntriesByType('resource').length") == 0


def colors(png: bytes) -> int:
    """Return how many colours a picture has."""
    from io import BytesIO  # noqa: PLC0415

    from matplotlib.image import imread  # noqa: PLC0415 - an extra

    pixels = (imread(BytesIO(png))[:, :, :3] * 255).astype(np.uint32) @ (1 << 16, 1 << 8, 1)
    return len(np.unique(pixels))
