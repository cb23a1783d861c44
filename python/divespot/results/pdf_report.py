"""A report as a PDF, set by Typst."""

from __future__ import annotations

import json
import re
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
    from divespot.report import Report

#: By its end a later run knows its own files; see `divespot.output.PAGE`. Readers pass over it.
MARK = b"\n% written by divespot\n"

#: Columns of texts in tables; all others are of numbers.
_WORDS = ("pile", "object", "name", "reason", "remarks")


def pdf_report(report: Report, survey: Survey | None = None) -> bytes:
    """Return the PDF.

    Raises
    ------
    DivespotError
        The extra ``report`` is not installed.

    """
    typst = extra("typst", "report", "a report as PDF needs typst")
    matplotlib = extra("matplotlib", "report", "a report as PDF needs matplotlib")
    survey = survey or Survey()
    doc = Document.of(report, survey, MOST_SECTIONS)
    with TemporaryDirectory(prefix="divespot-") as folder:
        place = Path(folder)
        drawn = _draw(report, doc, place) if report.scene is not None else {}
        if survey.past:
            curve = history_svg(survey.with_now(report), Shown.of(report))
            (place / "history.svg").write_text(curve, encoding="utf-8")
        template = files("divespot.results").joinpath("templates", "report.typ")
        (place / "report.typ").write_bytes(template.read_bytes())
        told = json.dumps({**_NOTHING_DRAWN, **_told(doc), **drawn, "history": bool(survey.past)})
        (place / "report.json").write_text(told, encoding="utf-8")
        # The drawings' letters come with matplotlib; no machine need have fonts.
        fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
        pdf: bytes = typst.compile(place / "report.typ", root=place, font_paths=[fonts])
    return pdf + MARK


_NOTHING_DRAWN: dict[str, Any] = {"plan": False, "budget": False, "sections": []}


def _draw(report: Report, doc: Document, place: Path) -> dict[str, Any]:
    """Write the drawings beside the template; return which there are."""
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
    for file, drawing in drawings.items():
        (place / file).write_text(drawing, encoding="utf-8")
    return {"plan": True, "budget": bool(report.piles), "sections": sections}


def _told(doc: Document) -> dict[str, Any]:
    """Return what the template sets."""
    plain = ("title", "facts", "trust", "change", "warnings", "settings")
    return {
        **{name: getattr(doc, name) for name in (*plain, "more_sections")},
        "texts": doc.texts,
        "provenance": [(name, _breakable(value)) for name, value in doc.provenance],
        "footer": doc.texts["footer_paper"].format(version=_native.__version__),
        "piles": _cells(doc.piles, doc),
        "filled": None if doc.filled is None else _cells(doc.filled, doc),
        "left_out": None if doc.left_out is None else _cells(doc.left_out, doc),
    }


def _breakable(text: str) -> str:
    """Return a text whose long words may end a line anywhere."""
    return re.sub(r"(\S{12})(?=\S)", "\\1\u200b", text)


def _cells(table: Table, doc: Document) -> dict[str, Any]:
    words = {doc.texts[name] for name in _WORDS}
    return {
        "header": table.header,
        "rows": [[cell.text for cell in row] for row in table.rows],
        "total": [cell.text for cell in table.total],
        "left": [i for i, name in enumerate(table.header) if name in words],
    }
