"""The ground from the camera's height, from the peaks' midpoint, and on several plateaus."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from divespot.evaluate.statistics import ErrorStatistics
from divespot.reproduce import factor, paper
from divespot.reproduce.experiment import Experiment
from divespot.reproduce.page import Finding, Section, Table, counted, percent
from divespot.reproduce.scans import OURS, PAPER, Scan, Variant
from divespot.reproduce.staging import BIAS_M, PLATEAUS_M, STEP_M
from divespot.simulate import Camera
from divespot.simulate.shapes import ROWS

if TYPE_CHECKING:
    from divespot.reproduce.found import Found, Need
    from divespot.reproduce.plan import Plan

HEIGHT_M = Camera().height_m
CAMERA = f"camera-height={HEIGHT_M}"
VARIANTS = {
    "peak": Variant("paper, peak", PAPER),
    "camera": Variant("paper, camera height", PAPER.changed(base=CAMERA)),
    "midpoint": Variant("paper, midpoint", PAPER.changed(base="midpeak")),
    "local": Variant("default", OURS),
}
FINE: Any = {"bin_m": 0.001, "window": 3}
"""A histogram fine enough to show plateaus, which are one peak with the usual bins."""
UNEVEN = {
    "peak": Variant("paper, fine peak", PAPER.tuned(**FINE)),
    "midpoint": Variant("paper, fine midpoint", PAPER.tuned(base="midpeak", **FINE)),
    "local": VARIANTS["local"],
}
FLOORS = {
    "as it is": "one level",
    "plateaus": f"several plateaus (frames off by {1000 * PLATEAUS_M:.0f} mm)",
    "stepped": f"a step of {1000 * STEP_M:.0f} mm under the pile",
}
ONE_OF_THREE = tuple(ROWS)[1::3]
"""A shape of each area and volume, for floors that are not one level."""


def _needs(plan: Plan, names: tuple[str, ...], stage: str, variant: Variant) -> list[Need]:
    return [
        (Scan(name, plan.seed, repeat, plan.side_density, stage), variant)
        for name in names
        for repeat in range(plan.side_rounds)
    ]


def _of_area(area_m2: float) -> tuple[str, ...]:
    return tuple(name for name, (area, _, _) in ROWS.items() if area == area_m2)


def needs(plan: Plan) -> list[Need]:
    """Return all shapes from the lens, some on other floors, and the scans of the factor."""
    lens = [n for v in VARIANTS.values() for n in _needs(plan, tuple(ROWS), "from the lens", v)]
    floors = [n for f in FLOORS for v in UNEVEN.values() for n in _needs(plan, ONE_OF_THREE, f, v)]
    return [*lens, *floors, *factor.needs(plan, plan.side_density)]


def _error(found: Found, plan: Plan, needed: list[Need]) -> float:
    local = needed[0][1] == VARIANTS["local"]
    piles = found.piles(needed) if local else factor.compensated(found, plan, needed)
    return ErrorStatistics.of(piles).mean_error or 0.0


def errors(found: Found, plan: Plan) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return mean errors by area and ground, and by floor and ground."""
    areas = {
        str(area): {
            name: _error(found, plan, _needs(plan, _of_area(area), "from the lens", v))
            for name, v in VARIANTS.items()
        }
        for area in paper.AREAS
    }
    floors = {
        floor: {
            name: _error(found, plan, _needs(plan, ONE_OF_THREE, floor, v))
            for name, v in UNEVEN.items()
        }
        for floor in FLOORS
    }
    return areas, floors


def section(found: Found, plan: Plan) -> Section:
    """Return the section of the page."""
    areas, floors = errors(found, plan)
    return Section(
        "The ground by other means",
        [
            _told(plan),
            _areas(areas),
            _told_floors(),
            _floors(floors),
        ],
        {"areas": areas, "floors": floors},
        _findings(areas, floors),
    )


def _told(plan: Plan) -> str:
    return (
        f"All 18 shapes, {counted(plan.side_rounds, 'scan')} each with {plan.side_density:.0%} of "
        "the full number of points, in the frame of the camera's lens, which is "
        f"{HEIGHT_M} m above the ground and measures {1000 * BIAS_M:.0f} mm too far, as a "
        "time-of-flight camera may. The first three columns are the paper's method with its ground "
        "from the histogram's peak, the camera's height and the midpoint of the peaks, with "
        "factors calibrated as for the shapes; the fourth is `Settings()`, whose base is the "
        "ground around each pile. Such a camera makes everything larger, a volume by "
        f"{percent(3.0 * BIAS_M / HEIGHT_M)}, whatever the ground is taken from."
    )


def _told_floors() -> str:
    return (
        f"Floors that are not one level, {len(ONE_OF_THREE)} of the shapes, with bins of 1 mm and "
        "a window of 3 bins in the paper's method: in wider bins the plateaus are one peak."
    )


def _areas(areas: dict[str, Any]) -> Table:
    header = (
        *("area m²", "peak", "camera height", "midpoint", "`Settings()`"),
        *("paper: peak", "paper: camera height", "paper: midpoint"),
    )
    texts = []
    for area, theirs in paper.AREAS.items():
        row = areas[str(area)]
        shares = (*row.values(), theirs, paper.CAMERA_HEIGHT[area], paper.MIDPOINT[area])
        texts.append((f"{area}", *map(percent, shares)))
    return Table(header, tuple(texts))


def _floors(floors: dict[str, Any]) -> Table:
    texts = [(FLOORS[floor], *map(percent, row.values())) for floor, row in floors.items()]
    return Table(("floor", "peak", "midpoint", "`Settings()`"), tuple(texts))


def _findings(areas: dict[str, Any], floors: dict[str, Any]) -> list[Finding]:
    return [*_of_grounds(areas), *_of_floors(floors), _against_paper(areas)]


def _of_grounds(areas: dict[str, Any]) -> list[Finding]:
    rows = areas.values()
    midpoints = [row["midpoint"] for row in rows]
    return [
        Finding(
            "the camera's measured height is a far worse ground than the peak",
            all(row["camera"] > 2.0 * row["peak"] for row in rows),
            ", ".join(f"{percent(row['camera'])} against {percent(row['peak'])}" for row in rows),
        ),
        Finding(
            "the midpoint of the peaks is no better than the peak on a level floor",
            sum(row["midpoint"] for row in rows) >= sum(row["peak"] for row in rows),
            ", ".join(f"{percent(row['midpoint'])} against {percent(row['peak'])}" for row in rows),
            "Registration errors spread the peaks of these scans on both sides of the floor that "
            "the pile stands on, so their midpoint averages over them.",
        ),
        Finding(
            "the midpoint keeps the error within 5 %",
            max(midpoints) <= 0.05,
            f"at most {percent(max(midpoints))}",
            "Small piles suffer most from a ground that is off by a millimetre.",
        ),
    ]


def _of_floors(floors: dict[str, Any]) -> list[Finding]:
    plateaus, level = floors["plateaus"], floors["as it is"]
    return [
        Finding(
            "a floor of several plateaus makes the peak worse",
            plateaus["peak"] > level["peak"],
            f"{percent(level['peak'])} to {percent(plateaus['peak'])}",
        ),
        Finding(
            "there the midpoint is the better ground",
            plateaus["midpoint"] < plateaus["peak"],
            f"{percent(plateaus['midpoint'])} against {percent(plateaus['peak'])}",
            "The plateaus under a pile need not be centred on those of the whole floor, and the "
            "plane was fitted to one or through several of them before.",
        ),
    ]


def _against_paper(areas: dict[str, Any]) -> Finding:
    grounds = (paper.AREAS, paper.CAMERA_HEIGHT, paper.MIDPOINT)
    theirs = [
        row["local"] < min(ground[float(area)] for ground in grounds) for area, row in areas.items()
    ]
    return Finding(
        "`Settings()` is closer than the paper with any ground on every area",
        all(theirs),
        f"{sum(theirs)} of {len(theirs)}",
        "The camera's range error is in every volume; the paper's factor is calibrated against it, "
        "and `Settings()` has no factor.",
    )


EXPERIMENT = Experiment("grounds", section, needs)
