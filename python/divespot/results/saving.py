"""Saving a report in the format of the name's ending."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, TypeAlias

from divespot.output import (
    DEM,
    GEOPACKAGE,
    OUTLINES,
    PAGE,
    PICTURE,
    POINTS,
    REPORT,
    TABLE,
    other_ending,
    refuse_inputs,
    require_own,
    write_text,
)
from divespot.plot import save_picture
from divespot.results.csv_rows import save_csv
from divespot.results.dem import save_dem
from divespot.results.geopackage import save_gpkg
from divespot.results.las_points import save_las
from divespot.results.mesh import save_mesh
from divespot.results.outlines import save_outlines
from divespot.results.report_file import ENDINGS, save_report

if TYPE_CHECKING:
    import os
    import re
    from collections.abc import Callable

    from divespot.report import Report

    Path: TypeAlias = str | os.PathLike[str]


def save(report: Report, path: Path, *, force: bool = False) -> None:
    """Write a report, never over an input, and over other programs' files only with `force`."""
    ending = PurePath(path).suffix.lower()
    if ending not in WRITERS:
        raise other_ending(path, "a report", WRITERS)
    own, write = WRITERS[ending]
    refuse_inputs(path, "the report", report.inputs)
    require_own(path, own, "the report", force=force)
    write(report, path)


def _json(report: Report, path: Path) -> None:
    write_text(path, report.to_json() + "\n")


#: For each ending, a pattern of the files that divespot writes, and the function that writes them.
WRITERS: dict[str, tuple[re.Pattern[bytes], Callable[[Report, Path], None]]] = {
    ".json": (REPORT, _json),
    ".csv": (TABLE, save_csv),
    ".geojson": (OUTLINES, save_outlines),
    ".gpkg": (GEOPACKAGE, save_gpkg),
    **dict.fromkeys((".las", ".laz"), (POINTS, save_las)),
    ".ply": (POINTS, save_mesh),
    **dict.fromkeys((".tif", ".tiff"), (DEM, save_dem)),
    **dict.fromkeys((".png", ".svg"), (PICTURE, save_picture)),
    **dict.fromkeys(ENDINGS, (PAGE, save_report)),
}
