"""A report as one self-contained HTML page."""

from __future__ import annotations

import gzip
import json
from base64 import b64encode
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from divespot import _native
from divespot.extras import extra
from divespot.results.document import Document, Survey
from divespot.results.drawings import (
    MOST_SECTIONS,
    budget_svg,
    history_svg,
    numbered,
    plan_svg,
    section_svgs,
    themed,
)
from divespot.results.scene3d import scene
from divespot.results.show_units import Shown

if TYPE_CHECKING:
    from collections.abc import Iterable

    from divespot.report import Report

NEED = "a report page needs {}"


def html_report(report: Report, survey: Survey | None = None) -> str:
    """Return the page.

    Raises
    ------
    DivespotError
        The extra ``report`` is not installed.

    """
    jinja2 = extra("jinja2", "report", NEED.format("Jinja2"))
    extra("matplotlib", "report", NEED.format("matplotlib"))
    survey = survey or Survey()
    doc = Document.of(report, survey, MOST_SECTIONS)
    safe = jinja2.utils.markupsafe.Markup
    page = template("report.html.j2")
    known = _drawn(report, doc) if report.scene is not None else {}
    if survey.past:
        curve = history_svg(survey.with_now(report), Shown.of(report))
        known["history"] = themed(numbered(curve, -1))
    return str(
        page.render(
            doc=doc,
            t=doc.texts,
            version=_native.__version__,
            css=safe(template_text("report.css")),
            report_json=safe(in_script(report.to_json(indent=None))),
            **{
                name: safe(value) if isinstance(value, str) else value
                for name, value in known.items()
            },
        )
    )


def _drawn(report: Report, doc: Document) -> dict[str, Any]:
    """Return the parts that need the heights: plan, sections, bars and the 3D view."""
    markup = extra("jinja2", "report", NEED.format("Jinja2")).utils.markupsafe.Markup
    words = json.dumps({"failed": doc.texts["view_failed"]})
    drawings = section_svgs(report, doc.texts)
    on_page = list(_on_page([plan_svg(report), *(drawing for _, drawing in drawings)]))
    names, axis = doc.texts["term_names"], doc.texts["uncertainty_axis"]
    bars = budget_svg(report, names, axis) if report.piles else ""
    return {
        "plan": on_page[0],
        "sections": [
            (pile, markup(drawing))
            for (pile, _), drawing in zip(drawings, on_page[1:], strict=True)
        ],
        "budget": themed(numbered(bars, len(on_page))),
        "scene": in_script(json.dumps(scene(report))),
        "plotly": _plotly(),
        "view": template_text("view.js").replace("WORDS", in_script(words)),
    }


def _on_page(drawings: Iterable[str]) -> Iterable[str]:
    return (themed(numbered(drawing, number)) for number, drawing in enumerate(drawings))


def _plotly() -> str:
    """Return Plotly's script, compressed, since it would exceed the page's size limit otherwise."""
    extra("plotly", "report", NEED.format("plotly"))
    script = files("plotly").joinpath("package_data", "plotly.min.js").read_bytes()
    return b64encode(gzip.compress(script, compresslevel=6, mtime=0)).decode()


def template(name: str) -> Any:  # noqa: ANN401 - of Jinja2, which may be absent
    """Return a page template."""
    jinja2 = extra("jinja2", "report", NEED.format("Jinja2"))
    loader = jinja2.FunctionLoader(template_text)
    return jinja2.Environment(autoescape=True, trim_blocks=True, loader=loader).get_template(name)


def in_script(text: str) -> str:
    """Return JSON escaped so that no tag within it ends the script."""
    return text.replace("<", "\\u003c")


def template_text(name: str) -> str:
    """Return the text of a template file."""
    return files("divespot.results").joinpath("templates", name).read_text("utf-8")
