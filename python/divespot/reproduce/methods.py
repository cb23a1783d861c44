"""The comparison of volume methods."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.pipeline import measure
from divespot.reproduce.charts import Chart, Line
from divespot.reproduce.compression import LARGE
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Picture, Section, Table, counted, percent
from divespot.reproduce.scans import OURS, Scan
from divespot.volume import bodies_of, hull, inner_voxels, slices, tin
from divespot.volume.alpha import tetrahedra
from divespot.volume.methods import REACH_CELLS

if TYPE_CHECKING:
    from divespot.reproduce.found import Found, Round
    from divespot.reproduce.plan import Plan
    from divespot.volume import Body

SLICES_M = (0.0005, 0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)
ALPHAS_M = (0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, 1.0, 3.0)
SINGLE = ("grid", "tin", "voxels", "hull")
CONTOURS = ("convex", "concave")
PILES = dict(zip(LARGE, ("cone", "ridge", "several peaks"), strict=True))
"""The three piles, of equal volume and different kinds."""
BAND = 0.02


@dataclass(frozen=True)
class MethodsRound:
    """A scan whose largest pile is found once, then measured by every method and parameter."""

    methods_of: Scan

    def result(self) -> dict[str, Any]:
        """Return relative errors: a number per method, or a list for a parameter sweep."""
        taken = self.methods_of.take()
        report = measure(taken.points, OURS)
        if not report.piles:
            raise DivespotError(
                f"{self.methods_of.scene}: no pile was found: one is needed to compare methods on"
            )
        body = bodies_of(report)[0]
        volumes = {"grid": report.piles[0].volume_m3, **_single(body), **_swept(body)}
        return {name: _error(value, taken.volume_m3) for name, value in volumes.items()}


def _single(body: Body) -> dict[str, Any]:
    return {
        "voxels": inner_voxels(body.points_m, body.cell_m),
        "tin": tin(body.points_m, body.outline_m),
        "hull": hull(body.points_m),
    }


def _swept(body: Body) -> dict[str, Any]:
    points, reach_m = body.points_m, REACH_CELLS * body.cell_m
    volumes, radii = tetrahedra(points)
    return {
        "convex": [slices(points, thick, contour="convex") for thick in SLICES_M],
        "concave": [
            slices(points, thick, contour="concave", reach_m=reach_m) for thick in SLICES_M
        ],
        "alpha": [volumes[radii <= alpha].sum() for alpha in ALPHAS_M],
    }


def _error(volume_m3: Any, truth_m3: float) -> Any:  # noqa: ANN401 - one or many
    return (np.asarray(volume_m3) / truth_m3 - 1.0).tolist()


def rounds(plan: Plan) -> list[Round]:
    """Return a few scans of each pile."""
    return [
        MethodsRound(Scan(name, plan.seed, repeat, plan.side_density))
        for name in LARGE
        for repeat in range(plan.side_rounds)
    ]


def errors(found: Found, plan: Plan) -> dict[str, dict[str, Any]]:
    """Return the mean relative error of each pile, by method and parameter."""
    return {name: _mean(found, plan, name) for name in LARGE}


def _mean(found: Found, plan: Plan, name: str) -> dict[str, Any]:
    results = [
        found.results[one]
        for one in rounds(plan)
        if isinstance(one, MethodsRound) and one.methods_of.scene == name
    ]
    keys = results[0].keys()
    return {key: np.mean([r[key] for r in results], axis=0).tolist() for key in keys}


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    table = errors(found, plan)
    return Section(
        "Volume methods",
        [
            _told(plan),
            _singles(table),
            _singles_picture(table),
            "Slices, by thickness in m:",
            _sweep(table, CONTOURS, SLICES_M),
            _picture("slices", "thickness of a slice in m", table, CONTOURS, SLICES_M),
            "alpha shape, by alpha in m:",
            _sweep(table, ("alpha",), ALPHAS_M),
            _picture("alpha", "alpha in m", table, ("alpha",), ALPHAS_M),
        ],
        {"errors": table, "slices_m": SLICES_M, "alphas_m": ALPHAS_M},
        _findings(table),
    )


def _told(plan: Plan) -> str:
    return (
        f"The three shapes on 5.2 m² (0.335 m³ each), {counted(plan.side_rounds, 'scan')} each "
        f"with {plan.side_density:.0%} of the full number of points. Each pile is found once by "
        "`Settings()`; every method then gets the same cells above the same base, so that results "
        "differ only by the method. Errors are signed, the band in the figures is 2 %."
    )


def _singles(table: dict[str, dict[str, Any]]) -> Table:
    texts = [
        (f"{name} ({PILES[name]})", *(percent(row[method]) for method in SINGLE))
        for name, row in table.items()
    ]
    return Table(("pile", *SINGLE), tuple(texts))


def _singles_picture(table: dict[str, dict[str, Any]]) -> Picture:
    number = tuple(float(i) for i in range(len(SINGLE)))
    lines = tuple(
        Line(PILES[name], number, tuple(100 * row[method] for method in SINGLE))
        for name, row in table.items()
    )
    chart = Chart("", "error in %", lines, SINGLE, band=100 * BAND)
    return Picture("methods", "Error of the methods without a parameter; 2 % band", chart)


def _sweep(
    table: dict[str, dict[str, Any]], methods: tuple[str, ...], values: tuple[float, ...]
) -> Table:
    texts = [
        (f"{PILES[name]}, {method}", *map(percent, row[method]))
        for method in methods
        for name, row in table.items()
    ]
    return Table(("pile", *(f"{value:g}" for value in values)), tuple(texts))


def _picture(
    name: str,
    label: str,
    table: dict[str, dict[str, Any]],
    methods: tuple[str, ...],
    values: tuple[float, ...],
) -> Picture:
    lines = tuple(
        Line(f"{PILES[pile]}, {method}", values, tuple(100 * e for e in row[method]))
        for method in methods
        for pile, row in table.items()
    )
    grids = [100 * row["grid"] for row in table.values()]
    grid = Line("ground grid (mean)", values, (statistics.fmean(grids),) * len(values), dashed=True)
    chart = Chart(label, "error in %", (*lines, grid), log_x=True, log_y=True, band=100 * BAND)
    return Picture(name, f"Error against {label.removesuffix(' in m')}; 2 % band", chart)


def within_band(table: dict[str, dict[str, Any]], method: str) -> list[bool]:
    """Return for each parameter whether all piles are within the band."""
    swept = np.array([row[method] for row in table.values()])
    return [bool(ok) for ok in (np.abs(swept) <= BAND).all(axis=0)]


def _findings(table: dict[str, dict[str, Any]]) -> list[Finding]:
    convex = np.mean([row["convex"] for row in table.values()], axis=0)
    alphas = np.mean([row["alpha"] for row in table.values()], axis=0)
    fits = [f"{a:g} m" for a, ok in zip(ALPHAS_M, within_band(table, "alpha"), strict=True) if ok]
    held = {method: sum(within_band(table, method)) for method in CONTOURS}
    worst = max(abs(row["grid"]) for row in table.values())
    hulls = [row["hull"] for row in table.values()]
    return [
        Finding(
            "thin slices give too little, thick ones too much",
            bool(convex[0] < -BAND and convex[-1] > BAND),
            f"{percent(convex[0])} at {SLICES_M[0]} m, {percent(convex[-1])} at {SLICES_M[-1]} m",
        ),
        Finding(
            "no thickness of convex slices suits all three piles within 2 %",
            held["convex"] == 0,
            f"{held['convex']} of {len(SLICES_M)} do, {held['concave']} with concave contours",
            "At one thickness, what thin slices miss and what thick ones add cancel; it depends "
            "on the spacing of the points.",
        ),
        Finding(
            "the volume of an alpha shape depends on alpha",
            bool(np.ptp(alphas) > 2.0 * BAND),
            f"{percent(alphas[0])} at {ALPHAS_M[0]} m, {percent(alphas[-1])} at {ALPHAS_M[-1]} m",
        ),
        Finding(
            "no alpha brings all three piles within 2 %",
            not fits,
            f"within: {', '.join(fits) or 'none'}",
            "The surface is one mean height per cell here, so noise does not break the shape near "
            "the right alpha; but alpha must be known, and depends on the pile's height.",
        ),
        Finding(
            "the convex hull gives too much where a pile is not convex",
            max(hulls) > BAND,
            f"{percent(min(hulls))} to {percent(max(hulls))}",
        ),
        Finding(
            "the ground grid stays within 2 % without a parameter",
            worst <= BAND,
            f"at most {percent(worst)}",
        ),
    ]


EXPERIMENT = Experiment("methods", section, rounds=rounds)
