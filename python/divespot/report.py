"""The result of a measurement: the report and its JSON (schema ``divespot.report/1``)."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from divespot import _native
from divespot._arguments import whole
from divespot.base_name import BaseName
from divespot.budget import COMMON
from divespot.errors import DivespotError
from divespot.mass import total_mass_kg

if TYPE_CHECKING:
    from collections.abc import Mapping

    from divespot.budget import Budget
    from divespot.directions import Position
    from divespot.errors import Status
    from divespot.intake import Source
    from divespot.level import Level
    from divespot.reasons import Reason
    from divespot.settings import Settings
    from divespot.up import UpFrom

SCHEMA = "divespot.report/1"

#: What a local base was predicted from.
BaseFrom: TypeAlias = Literal["annulus", "annulus level", "ground"]

#: Coverage factor: an expanded uncertainty of 95 % is 2 standard uncertainties (GUM 6.3.3).
COVERAGE = 2.0

#: Widest indent of JSON, in blanks.
MOST_INDENT = 100


@dataclass(frozen=True)
class Pile:
    """One object on the ground. Positions are in the scan's own frame and unit.

    Attributes
    ----------
    id
        Number in the report, starting at 1 with the largest.
    volume_m3
        `cut_m3` less `fill_m3`: negative for a hole.
    u95_m3
        Expanded uncertainty of the volume: the true volume should lie within it in 95 of 100
        cases. Twice the standard uncertainty to which `budget` adds up.
    cut_m3
        Volume above the base.
    fill_m3
        Volume missing below the base, as a positive number.
    footprint_m2
        Area that the object covers in plan.
    max_height_m
        Height of its highest cell above the base.
    centroid_m
        Centre of volume.
    outline_m
        Corners of the outline at the base, counter-clockwise from above, the first not repeated.
    seen_fraction
        Share of the footprint's cells that were seen; the others were filled.
    touches_edge
        Whether the object runs out of the scan: the part beyond is not counted.
    leans_on_wall
        Whether the object leans on walls, which are not part of it.
    mass_kg
        Volume times bulk density; null without a density.
    u95_mass_kg
        Expanded uncertainty of the mass, including that of the density.
    base
        Kind of the base that was asked for (see the setting of this name).
    base_from
        What a local base was predicted from: the annulus of ground around the pile, its level
        with the tilt of the scene's ground, or the scene's ground alone; null for other bases.
    budget
        Uncertainty budget: the terms of the uncertainty.
    volume_by_base_m3
        Volumes above the bases that were compared; null if none were.
    repeat_m3
        Largest change of the volume in repeated measurements of slightly changed scans; null if
        there were none.
    name
        Name of the outline, if one was given.
    material
        Material that the outline names, otherwise the one that was asked for.
    reason
        Why the object is not a pile; only for other objects.

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
    base_from: BaseFrom | None
    budget: Budget
    volume_by_base_m3: Mapping[str, float] | None = None
    repeat_m3: float | None = None
    name: str | None = None
    material: str | None = None
    reason: Reason | None = None


@dataclass(frozen=True)
class Total:
    """All piles together; errors common to all piles add linearly.

    Attributes
    ----------
    volume_m3
        Sum of the piles' volumes.
    u95_m3
        Expanded uncertainty of the total volume.
    mass_kg
        Volume times bulk density; null without a density.
    u95_mass_kg
        Expanded uncertainty of the mass.

    """

    volume_m3: float
    u95_m3: float
    mass_kg: float | None
    u95_mass_kg: float | None

    @classmethod
    def of(cls, piles: tuple[Pile, ...], settings: Settings) -> Total:
        """Add up piles: terms common to all piles linearly, the others in squares."""
        common = [sum(getattr(pile.budget, term) for pile in piles) for term in COMMON]
        own = dict.fromkeys(COMMON, 0.0)
        rest = (dataclasses.replace(pile.budget, **own).combined_m3() for pile in piles)
        volume, u = sum(pile.volume_m3 for pile in piles), math.hypot(*common, *rest)
        mass, u_mass = total_mass_kg(piles, COMMON, settings)
        return cls(volume, COVERAGE * u, mass, None if u_mass is None else COVERAGE * u_mass)


@dataclass(frozen=True)
class Ground:
    """The plane of the ground, ``normal @ p == offset_m`` in metres in the scan's frame.

    Attributes
    ----------
    normal
        Unit normal of the plane, pointing up.
    offset_m
        Signed distance of the plane from the scan's origin along the normal.
    tilt_deg
        Angle between z, or the given up, and the normal of the plane that fits the ground.
    roughness_m
        Standard deviation of the ground's cells about the ground's surface.
    inlier_fraction
        Share of the points within the threshold of the plane.
    up_from
        Evidence for which way is up: ``given``; ``sensor``, which cannot see a floor from below;
        ``coordinate system``: a projected one, where z is up and nothing is turned; ``small
        tilt``: a floor that is almost level in the scan's own frame; ``nothing below``: the side
        of the ground on which the scan lies.

    """

    normal: Position
    offset_m: float
    tilt_deg: float
    roughness_m: float
    inlier_fraction: float
    up_from: UpFrom


@dataclass(frozen=True, repr=False)
class Report:
    """The result of `divespot.measure`, data only (`divespot.doors` adds the methods).

    Attributes
    ----------
    source
        Where the points came from.
    piles
        The piles, largest first.
    other_objects
        Objects and holes that are not piles, largest first, each with the reason.
    total
        All piles together.
    ground
        The plane of the ground.
    settings
        The settings used, including the lengths derived from the scan.
    timings_s
        Seconds per stage, in the order of the stages.
    warnings
        What a user should know before trusting the numbers, one sentence each.
    scene
        The levelled scene, for pictures; not in the JSON, so None in a report read from it.

    """

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
            The report was read from JSON, which has no scene.

        """
        if self.scene is None:
            raise DivespotError(
                "this report was read from JSON, which holds no heights: a measured one is needed"
            )
        return self.scene

    @property
    def inputs(self) -> tuple[str | None, ...]:
        """Paths of all inputs, which no output may overwrite."""
        base = BaseName.parse(self.settings.base)
        earlier = base.path if base is not None and base.path else None
        outline = self.settings.outline
        named = outline if isinstance(outline, str) else None
        return self.source.path, *self.source.files, named, earlier

    @property
    def status(self) -> Status:
        """Outcome of the scan: ``measured``, or ``no_pile`` if none was found."""
        return "measured" if self.piles else "no_pile"

    @property
    def seed(self) -> int:
        """The seed of all random draws."""
        return self.settings.seed

    def to_dict(self) -> dict[str, Any]:
        """Return the report as a dict for JSON, following the schema."""
        piles = [_without_reason(pile) for pile in self.piles]
        return {
            "schema": SCHEMA,
            "divespot": _native.__version__,
            "status": self.status,
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

        Numbers that are not finite become null.
        """
        if indent is not None:
            whole("indent", indent, MOST_INDENT)
        return json.dumps(finite(self.to_dict()), indent=indent, allow_nan=False)


def _without_reason(pile: Pile) -> dict[str, Any]:
    return {name: value for name, value in dataclasses.asdict(pile).items() if name != "reason"}


def finite(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    """Return a JSON value with null in place of numbers that are not finite."""
    if isinstance(value, dict):
        return {name: finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
