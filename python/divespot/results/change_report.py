"""Saving a comparison: a page to read and sign, a plan, heights, outlines, JSON."""

from __future__ import annotations

import json
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from divespot import _native
from divespot.extras import extra
from divespot.output import (
    DEM,
    GEOPACKAGE,
    OUTLINES,
    PAGE,
    PICTURE,
    REPORT,
    other_ending,
    refuse_inputs,
    require_own,
    whole,
)
from divespot.plot import drawn_bytes
from divespot.report import finite
from divespot.results.change_document import ChangeDocument, Unit
from divespot.results.change_plan import draw_changes
from divespot.results.dem import save_heights
from divespot.results.drawings import numbered, svg, themed
from divespot.results.geopackage import layer
from divespot.results.html_report import NEED, in_script, template, template_text
from divespot.results.outlines import of_lines
from divespot.results.pdf_report import cells, common, needed, typeset

if TYPE_CHECKING:
    import os
    from typing import TypeAlias

    from matplotlib.figure import Figure

    from divespot.results.comparison import Comparison, Place

    Path: TypeAlias = str | os.PathLike[str]

BANDS = ("after", "before", "difference", "seen")

#: Fields of a place that are not attributes of its outline.
_ELSEWHERE = ("outline_m", "centroid_m", "net", "piles", "piles_before", "reason")


def change_html(found: Comparison, unit: Unit, site: str | None = None) -> str:
    """Return the page as one self-contained HTML file.

    Raises
    ------
    DivespotError
        The extra ``report`` is not installed.

    """
    safe = extra("jinja2", "report", NEED.format("Jinja2")).utils.markupsafe.Markup
    extra("matplotlib", "report", NEED.format("matplotlib"))
    doc = ChangeDocument.of(found, unit, site)
    page = template("change.html.j2").render(
        doc=doc,
        t=doc.texts,
        version=_native.__version__,
        css=safe(template_text("report.css")),
        plan=safe(themed(numbered(_plan_svg(found, unit), 0))),
        report_json=safe(in_script(found.to_json(indent=None))),
    )
    return str(page)


def change_pdf(found: Comparison, unit: Unit, site: str | None = None) -> bytes:
    """Return the page as PDF.

    Raises
    ------
    DivespotError
        The extra ``report`` is not installed.

    """
    needed()
    doc = ChangeDocument.of(found, unit, site)
    tables = {name: getattr(doc, name) for name in ("total", "places", "piles", "not_counted")}
    told = {
        **{
            name: getattr(doc, name) for name in ("title", "facts", "trust", "warnings", "settings")
        },
        **common(doc.texts, doc.provenance, doc.texts["change_title"]),
        **{n: None if table is None else cells(table, doc.texts) for n, table in tables.items()},
    }
    return typeset("change.typ", told, {"plan.svg": _plan_svg(found, unit)})


def _plan_svg(found: Comparison, unit: Unit) -> str:
    return svg(draw_changes(found, unit.sign, unit.per_m3, width_in=7.4))


def change_figure(found: Comparison, unit: Unit | None = None) -> Figure:
    """Draw the plan of gains and losses."""
    unit = unit or Unit.of(found)
    return draw_changes(found, unit.sign, unit.per_m3, _title(found, unit))


def save_change(
    found: Comparison,
    path: Path,
    *,
    site: str | None = None,
    unit: Unit | None = None,
    force: bool = False,
) -> None:
    """Write a comparison in the format of the path's ending, never over an input.

    Raises
    ------
    DivespotError
        The ending is unknown, an extra is missing, or the file must not be overwritten.

    """
    ending = PurePath(path).suffix.lower()
    if ending not in OWN:
        raise other_ending(path, "a comparison", OWN)
    refuse_inputs(path, "the comparison", found.inputs)
    require_own(path, OWN[ending], "the comparison", force=force)
    if ending in {".tif", ".tiff"}:
        return save_heights(found, path, BANDS, found.inputs)
    data = _bytes(found, path, ending, unit or Unit.of(found), site)
    with whole(path) as stream:
        stream.write(data)
    return None


#: For each ending, a pattern of the files that divespot writes.
OWN = {
    ".json": REPORT,
    ".geojson": OUTLINES,
    ".gpkg": GEOPACKAGE,
    **dict.fromkeys((".tif", ".tiff"), DEM),
    **dict.fromkeys((".html", ".pdf"), PAGE),
    **dict.fromkeys((".png", ".svg"), PICTURE),
}


def _bytes(found: Comparison, path: Path, ending: str, unit: Unit, site: str | None) -> bytes:
    if ending == ".html":
        return change_html(found, unit, site).encode("utf-8", "replace")
    if ending == ".pdf":
        return change_pdf(found, unit, site)
    if ending in {".png", ".svg"}:
        return drawn_bytes(change_figure(found, unit), path)
    if ending == ".json":
        return (found.to_json() + "\n").encode()
    outlines = [place.outline_m for place in found.places]
    rows = [finite(_attributes(place)) for place in found.places]
    if ending == ".gpkg":
        return layer(rows, outlines, found.source.crs, "places")
    collection = of_lines(zip(rows, outlines, strict=True), found.source)
    return (json.dumps(collection, indent=1, allow_nan=False) + "\n").encode()


def _title(found: Comparison, unit: Unit) -> str:
    return "no change detected" if found.net.is_none else f"net {unit.told(found.net)} {unit.sign}"


def _attributes(place: Place) -> dict[str, Any]:
    own = {name: value for name, value in vars(place).items() if name not in _ELSEWHERE}
    return {**own, "net_m3": place.net.volume_m3, "u95_m3": place.net.u95_m3}
