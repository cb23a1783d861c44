"""A report as a PDF, typeset by Typst."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from divespot import _native
from divespot.errors import printable
from divespot.extras import extra
from divespot.results.document import Document, Survey, Table
from divespot.results.drawings import MOST_SECTIONS, budget_svg, history_svg, plan_svg, section_svgs
from divespot.results.show_units import Shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from divespot.report import Report

#: A later run recognizes its own files by this ending, which PDF readers ignore; see
#: `divespot.output.PAGE`.
MARK = b"\n% written by divespot\n"

#: Table columns that hold text; all others hold numbers.
_WORDS = ("pile", "object", "name", "reason", "remarks", "place", "change_total", "state")


def pdf_report(report: Report, survey: Survey | None = None) -> bytes:
    """Return the PDF.

    Raises
    ------
    DivespotError
        The extra ``report`` is not installed.

    """
    needed()
    survey = survey or Survey()
    doc = Document.of(report, survey, MOST_SECTIONS)
    drawings = _draw(report, doc) if report.scene is not None else Drawings({}, {})
    if survey.past:
        curve = history_svg(survey.with_now(report), Shown.of(report))
        drawings.files["history.svg"] = curve
    told = {**_NOTHING_DRAWN, **_told(doc), **drawings.told, "history": bool(survey.past)}
    return typeset("report.typ", told, drawings.files)


def needed() -> tuple[Any, Any]:
    """Return typst and matplotlib."""
    typst = extra("typst", "report", "a report as PDF needs typst")
    return typst, extra("matplotlib", "report", "a report as PDF needs matplotlib")


def typeset(template: str, told: Mapping[str, Any], drawings: Mapping[str, str]) -> bytes:
    """Return the PDF that a template makes of texts and drawings."""
    typst, matplotlib = needed()
    with TemporaryDirectory(prefix="divespot-") as folder:
        place = Path(folder)
        for name in ("parts.typ", template):
            text = files("divespot.results").joinpath("templates", name).read_bytes()
            (place / name).write_bytes(text)
        for name, drawing in drawings.items():
            (place / name).write_text(drawing, encoding="utf-8")
        (place / "report.json").write_text(json.dumps(told), encoding="utf-8")
        # The fonts come with matplotlib, so that the system needs none.
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        pdf: bytes = typst.compile(place / template, root=place, font_paths=[fonts])
    return pdf + MARK


@dataclass(frozen=True)
class Drawings:
    """Drawings by file name, and the data that the template needs about them."""

    files: dict[str, str]
    told: dict[str, Any]


_NOTHING_DRAWN: dict[str, Any] = {"plan": False, "budget": False, "sections": []}


def _draw(report: Report, doc: Document) -> Drawings:
    """Draw a report's heights."""
    words = doc.texts
    drawings = {"plan.svg": plan_svg(report)}
    if report.piles:
        drawings["budget.svg"] = budget_svg(report, words["term_names"], words["uncertainty_axis"])
    sections = []
    for pile, drawing in section_svgs(report, words):
        file = f"section-{pile.id}.svg"
        name = f"{words['pile']} {pile.id}" + (f": {printable(pile.name)}" if pile.name else "")
        sections.append((name, file))
        drawings[file] = drawing
    return Drawings(drawings, {"plan": True, "budget": bool(report.piles), "sections": sections})


def _told(doc: Document) -> dict[str, Any]:
    """Return the data for the template."""
    plain = ("title", "facts", "trust", "change", "warnings", "settings")
    return {
        **{name: getattr(doc, name) for name in (*plain, "more_sections")},
        **common(doc.texts, doc.provenance, doc.texts["title"]),
        "piles": cells(doc.piles, doc.texts),
        "filled": None if doc.filled is None else cells(doc.filled, doc.texts),
        "left_out": None if doc.left_out is None else cells(doc.left_out, doc.texts),
    }


def common(
    words: Mapping[str, Any], provenance: Iterable[tuple[str, str]], kind: str
) -> dict[str, Any]:
    """Return the data for all templates."""
    return {
        "kind": kind,
        "texts": words,
        "provenance": [(name, _breakable(value)) for name, value in provenance],
        "footer": words["footer_paper"].format(version=_native.__version__),
    }


def _breakable(text: str) -> str:
    """Return a text whose long words may be broken anywhere."""
    return re.sub(r"(\S{12})(?=\S)", "\\1\u200b", text)


def cells(table: Table, words: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table in the form that the templates need."""
    left = {words[name] for name in _WORDS}
    return {
        "header": table.header,
        "rows": [[cell.text for cell in row] for row in table.rows],
        "total": [cell.text for cell in table.total],
        "left": [i for i, name in enumerate(table.header) if name in left],
    }
