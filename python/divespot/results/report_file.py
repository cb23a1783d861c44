"""A report page in a file, as HTML or PDF by the name's ending."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

from divespot._arguments import require_kind
from divespot.output import other_ending, refuse_inputs, whole
from divespot.report import Report
from divespot.results.html_report import html_report
from divespot.results.pdf_report import pdf_report

if TYPE_CHECKING:
    import os

    from divespot.results.document import Survey

ENDINGS = (".html", ".pdf")


def save_report(report: Report, path: str | os.PathLike[str], survey: Survey | None = None) -> None:
    """Write a page to read and sign.

    Raises
    ------
    DivespotError
        The ending is unknown, the extra ``report`` is missing, or the file cannot be written.

    """
    require_kind("report", report, Report)
    refuse_inputs(path, "the report", report.inputs)
    ending = PurePath(path).suffix.lower()
    if ending not in ENDINGS:
        raise other_ending(path, "a report page", ENDINGS)
    if ending == ".pdf":
        page = pdf_report(report, survey)
    else:
        page = html_report(report, survey).encode("utf-8", "replace")
    with whole(path) as stream:
        stream.write(page)
