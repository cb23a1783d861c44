"""The table of errors against compression."""

from __future__ import annotations

import statistics
from typing import TYPE_CHECKING, Any

from divespot.evaluate.statistics import ErrorStatistics
from divespot.reproduce import factor, paper
from divespot.reproduce.charts import Chart, Line
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Picture, Section, Table, counted, percent
from divespot.reproduce.scans import OURS, PAPER, Scan, Variant
from divespot.simulate.shapes import ROWS

if TYPE_CHECKING:
    from divespot.reproduce.found import Found, Need
    from divespot.reproduce.plan import Plan

LARGE = tuple(name for name, (area, _, _) in ROWS.items() if area == 5.2)
"""The shapes of the paper's table, for which its error without compression is given."""
PRESETS = {"default": OURS, "paper": PAPER}


def thinned(preset: str, voxel_m: float) -> Variant:
    """Return the variant of a preset for a voxel edge; without one, that of the shapes.

    The paper thins after its first filter, and its ground grid is adapted to the thinned points.
    """
    settings = PRESETS[preset]
    if not voxel_m:
        return Variant(preset, settings)
    name = f"{preset}, {voxel_m} m"
    if preset == "paper":
        return Variant(name, settings.tuned(voxel_m=voxel_m, cell_m=voxel_m))
    return Variant(name, settings, voxel_m)


def scans(plan: Plan) -> list[Scan]:
    """Return the scans of the large shapes."""
    return [
        Scan(name, plan.seed, repeat, plan.density)
        for name in LARGE
        for repeat in range(plan.side_rounds)
    ]


def _needs(plan: Plan, preset: str, voxel_m: float) -> list[Need]:
    return [(scan, thinned(preset, voxel_m)) for scan in scans(plan)]


def needs(plan: Plan) -> list[Need]:
    """Return the scans of the large shapes, thinned with each edge, and those of the factor."""
    every = [n for voxel in paper.COMPRESSION for p in PRESETS for n in _needs(plan, p, voxel)]
    return [*every, *factor.needs(plan, plan.density)]


def rows(found: Found, plan: Plan) -> list[dict[str, Any]]:
    """Return the results for each edge."""
    table = []
    for voxel_m, (kept, error) in paper.COMPRESSION.items():
        ours = [found.measurement(need) for need in _needs(plan, "default", voxel_m)]
        papers = factor.compensated(found, plan, _needs(plan, "paper", voxel_m))
        table.append(
            {
                "voxel_m": voxel_m,
                "kept": statistics.fmean(one.kept for one in ours),
                "points": statistics.fmean(one.points for one in ours),
                "ours": ErrorStatistics.of(one.pile for one in ours).mean_error,
                "paper_method": ErrorStatistics.of(papers).mean_error,
                "paper_kept": kept,
                "paper_error": error,
            }
        )
    return table


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    table = rows(found, plan)
    return Section(
        "Compression",
        [
            _told(plan),
            _table(table),
            _picture(table),
        ],
        {"rows": table},
        _findings(table),
    )


def _told(plan: Plan) -> str:
    return (
        f"The three shapes on 5.2 m², {counted(plan.side_rounds, 'scan')} each, thinned to the "
        "mean of each voxel: for `Settings()` before anything else, for the paper's method where "
        "it does so itself, after the first filter, with cells of the same edge. The coarsest "
        "voxels keep a little more of the points here than in the paper."
    )


def _table(table: list[dict[str, Any]]) -> Table:
    header = (
        *("voxel m", "points", "kept", "`Settings()`", "`Settings.paper()`"),
        *("paper: kept", "paper: error"),
    )
    texts = [
        (
            *(f"{row['voxel_m']:g}" if row["voxel_m"] else "origin", f"{row['points']:.0f}"),
            *(f"{row['kept']:.4f}", percent(row["ours"]), percent(row["paper_method"])),
            *(f"{row['paper_kept']:.4f}", percent(row["paper_error"])),
        )
        for row in table
    ]
    return Table(header, tuple(texts))


def _picture(table: list[dict[str, Any]]) -> Picture:
    columns = {"ours": "Settings()", "paper_method": "Settings.paper()", "paper_error": "the paper"}
    lines = tuple(
        Line(
            label,
            tuple(row["voxel_m"] for row in table),
            tuple(100 * row[key] for row in table),
            dashed=key == "paper_error",
        )
        for key, label in columns.items()
    )
    chart = Chart("edge of the voxels in m", "mean error in %", lines, log_y=True)
    return Picture("compression", "Mean error against the edge of the voxels", chart)


def _findings(table: list[dict[str, Any]]) -> list[Finding]:
    better = [row for row in table if row["ours"] < row["paper_error"]]
    tenth = [row for row in table if row["kept"] >= 0.01]
    worst = {key: max(row[key] for row in tenth) for key in ("ours", "paper_method")}
    return [
        Finding(
            "`Settings()` is closer than the paper at every edge",
            len(better) == len(table),
            f"{len(better)} of {len(table)}",
            "The coarsest voxels leave a few hundred points of the whole scene; a pile that is not "
            "found in them counts as 100 %.",
        ),
        Finding(
            "compression to 1 % of the points keeps the error near 5 % or below",
            max(worst.values()) <= 0.06,
            f"with 1 % of the points or more at most {percent(worst['paper_method'])} by the "
            f"paper's method and {percent(worst['ours'])} by `Settings()`",
        ),
        Finding(
            "compression far below 0.1 % costs tens of percent, as it does in the paper, "
            "with `Settings.paper()`",
            table[-1]["paper_method"] > 0.1,
            f"{percent(table[-1]['paper_method'])} at {table[-1]['voxel_m']:g} m",
        ),
    ]


EXPERIMENT = Experiment("compression", section, needs)
