"""What a measurement found: the report and its JSON (schema ``divespot.report/1``)."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from divespot._arguments import whole
from divespot.base_name import BaseName
from divespot.errors import DivespotError
from divespot.mass import mass_kg
from divespot.results.doors import Doors

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from divespot.frame import Frame
    from divespot.grid import HeightMap
    from divespot.settings import Settings

SCHEMA = "divespot.report/1"

#: Half-width, in standard deviations, of an expanded uncertainty of 95 %.
COVERAGE = 2.0

#: Terms of the budget that all piles of a scan have in common.
COMMON = ("registration_m3", "base_m3", "scale_m3", "rounding_m3")

#: Blanks before a line of JSON.
MOST_INDENT = 100

Position = tuple[float, float, float]

UpFrom = Literal["given", "sensor", "coordinate system", "small tilt", "nothing below"]


@dataclass(frozen=True)
class Source:
    """Where the points came from and how many were of no use.

    `unit` is the unit of the file's numbers; the report's positions are in it.
    """

    path: str | None
    points: int
    dropped_nonfinite: int
    dropped_zero: int
    unit: str
    crs: str | None


@dataclass(frozen=True)
class Budget:
    """Standard uncertainties of a volume, independent of each other (after the GUM).

    Attributes
    ----------
    noise_m3
        Noise of each cell's height, independent from cell to cell.
    registration_m3
        Noise that all of a pile's cells have in common: what fusing frames leaves.
    base_m3
        Height of the base.
    footprint_m3
        Where the pile ends.
    filled_m3
        Cells that were not seen.
    grid_m3
        Curvature within the cells.
    scale_m3
        Scale of the sensor.
    rounding_m3
        Coordinates rounded before they came here (see `divespot.rounding`).

    """

    noise_m3: float
    registration_m3: float
    base_m3: float
    footprint_m3: float
    filled_m3: float
    grid_m3: float
    scale_m3: float
    rounding_m3: float = 0.0

    def combined_m3(self) -> float:
        """Return the root of the sum of squares."""
        return math.hypot(*dataclasses.astuple(self))


@dataclass(frozen=True)
class Pile:
    """One object on the ground.

    `volume_m3` is `cut_m3` (above the base) less `fill_m3` (below it). `u95_m3` is the expanded
    uncertainty, twice the standard uncertainty that `budget` adds up to. `base` names what the
    base rests on. A pile that `touches_edge` runs out of the scan; the walls of one that
    `leans_on_wall` are not part of it. `volume_by_base_m3` are the volumes above the bases that
    were compared, None where none were. `name` is that of the outline, where one was given.
    `reason` says why the object is no pile; None for a pile.
    """

    id: int
    volume_m3: float
    u95_m3: float
    cut_m3: float
    fill_m3: float
    footprint_m2: float
    max_height_m: float
    centroid_m: Position
    outline_m: tuple[Position, ...]
    seen_fraction: float
    touches_edge: bool
    leans_on_wall: bool
    mass_kg: float | None
    u95_mass_kg: float | None
    base: str
    budget: Budget
    volume_by_base_m3: Mapping[str, float] | None = None
    name: str | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Total:
    """All piles together; what their errors have in common adds up linearly."""

    volume_m3: float
    u95_m3: float
    mass_kg: float | None
    u95_mass_kg: float | None

    @classmethod
    def of(cls, piles: tuple[Pile, ...], settings: Settings) -> Total:
        """Add up piles: what may be off to the same side in all adds up, the rest in squares."""
        common = [sum(getattr(pile.budget, term) for pile in piles) for term in COMMON]
        own = dict.fromkeys(COMMON, 0.0)
        rest = (dataclasses.replace(pile.budget, **own).combined_m3() for pile in piles)
        volume, u = sum(pile.volume_m3 for pile in piles), math.hypot(*common, *rest)
        mass, u_mass = mass_kg(volume, u, settings)
        return cls(volume, COVERAGE * u, mass, None if u_mass is None else COVERAGE * u_mass)


@dataclass(frozen=True)
class Ground:
    """The plane of the ground, ``normal @ p == offset_m`` in metres in the scan's frame.

    The normal is up. `up_from` says why: given, sensor (which cannot see a floor from below),
    coordinate system (a projected one, where z is up and the plane is level), small tilt (a floor
    lies all but level in the scan's own frame), nothing below (the scan lies on this side).
    `tilt_deg` is the angle between z, or the given up, and the normal of the plane that fits the
    ground. `roughness_m` is the standard deviation of the ground's cells about it,
    `inlier_fraction` the share of the points within the plane's threshold.
    """

    normal: Position
    offset_m: float
    tilt_deg: float
    roughness_m: float
    inlier_fraction: float
    up_from: UpFrom


@dataclass(frozen=True)
class Outline:
    """The outline of an object in the level frame, and why it is no pile; None for a pile."""

    corners_m: tuple[Position, ...]
    reason: str | None


@dataclass(frozen=True, eq=False)
class Level:
    """The levelled scene, for pictures: height map, ground, outlines in the report's order.

    `base_m` is the base in force below each cell, NaN where it is not known; `frame` is the way
    from here to the scan.
    """

    height_map: HeightMap
    ground_m: float
    outlines: tuple[Outline, ...]
    base_m: NDArray[np.float64]
    frame: Frame


@dataclass(frozen=True, repr=False)
class Report(Doors):
    """The result of `divespot.measure`."""

    source: Source
    piles: tuple[Pile, ...]
    other_objects: tuple[Pile, ...]
    total: Total
    ground: Ground
    settings: Settings
    timings_s: Mapping[str, float]
    warnings: tuple[str, ...]
    scene: Level | None = field(default=None, repr=False, compare=False)

    @property
    def level(self) -> Level:
        """The levelled scene, for pictures.

        Raises
        ------
        DivespotError
            The report is from JSON, which holds none.

        """
        if self.scene is None:
            raise DivespotError(
                "this report was read from JSON, which holds no heights: measure the scan again"
            )
        return self.scene

    @property
    def inputs(self) -> tuple[str | None, ...]:
        """Paths of all that was read: no output may take their place."""
        base = BaseName.parse(self.settings.base)
        earlier = base.path if base is not None and base.path else None
        return self.source.path, self.settings.outline, earlier

    @property
    def seed(self) -> int:
        """The seed of all random draws."""
        return self.settings.seed

    def to_dict(self) -> dict[str, Any]:
        """Return the report as the JSON contract has it."""
        from divespot import __version__  # noqa: PLC0415 - the package imports this module

        piles = [_without_reason(pile) for pile in self.piles]
        return {
            "schema": SCHEMA,
            "divespot": __version__,
            "source": dataclasses.asdict(self.source),
            "piles": piles,
            "other_objects": [dataclasses.asdict(item) for item in self.other_objects],
            "total": dataclasses.asdict(self.total),
            "ground": dataclasses.asdict(self.ground),
            "settings": dataclasses.asdict(self.settings),
            "seed": self.seed,
            "timings_s": dict(self.timings_s),
            "warnings": list(self.warnings),
        }

    def to_json(self, *, indent: int | None = 1) -> str:
        """Return the report as one JSON object, on one line if `indent` is None.

        What is not a number is null.
        """
        if indent is not None:
            whole("indent", indent, MOST_INDENT)
        return json.dumps(finite(self.to_dict()), indent=indent, allow_nan=False)


def _without_reason(pile: Pile) -> dict[str, Any]:
    return {name: value for name, value in dataclasses.asdict(pile).items() if name != "reason"}


def finite(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    """Return a JSON value with null for what is not a number."""
    if isinstance(value, dict):
        return {name: finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
