"""Makes the report's piles, other objects and warnings from the kernels' results."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from divespot.budget import Budget
from divespot.dot import dot
from divespot.level import Outline
from divespot.mass import density_of, mass_kg
from divespot.pose import FLAT_SHARE
from divespot.reasons import TOO_LITTLE_SEEN
from divespot.report import COVERAGE, Ground, Pile
from divespot.settings import given

if TYPE_CHECKING:
    from divespot import _native
    from divespot.directions import Position
    from divespot.frame import Frame
    from divespot.ground_level import GroundLevel
    from divespot.intake import Cloud
    from divespot.io.scan import Registration
    from divespot.objects import Measured
    from divespot.pose import Pose
    from divespot.rounding import Rounding
    from divespot.settings import Settings

#: A warning is given for a base that was asked for if its uncertainty is above this share of the
#: volume: the ground around the pile is then not at the base's height.
OFF_SHARE = 0.05


def ground_in_scan(pose: Pose, ground: GroundLevel, cloud: Cloud, points: int) -> Ground:
    """Describe the ground in the scan's own frame, in metres."""
    normal = pose.plane.normal
    offset = pose.plane.offset_m + ground.height_m + float(dot(normal, cloud.origin_m))
    share = pose.plane.inliers / points
    return Ground(normal, offset, pose.tilt_deg, ground.noise_m, share, pose.up_from)


@dataclass(frozen=True, eq=False)
class Described:
    """An object as the report has it, and its outline as pictures have it."""

    pile: Pile
    outline: Outline


def describe(
    measured: Measured,
    frame: Frame,
    rounding: Rounding,
    settings: Settings,
    registration: Registration | None = None,
) -> list[Described]:
    """Return all objects, placed in the scan's own frame, and their outlines in the level frame."""
    return [
        Described(
            _pile(item, measured, frame, rounding, settings, registration), _outline(item, frame)
        )
        for item in measured.objects
    ]


def _outline(item: _native.RawObject, frame: Frame) -> Outline:
    line = np.array(item.outline_m).reshape(-1, 3)
    corners = ((x, y, z) for x, y, z in frame.gaps.opened(line).tolist())
    return Outline(tuple(corners), item.reason)


def reported(
    found: list[Described],
) -> tuple[tuple[Pile, ...], tuple[Pile, ...], tuple[Outline, ...]]:
    """Return piles, other objects and the outlines of both, each largest first."""
    found = sorted(found, key=lambda item: item.pile.fill_m3 - item.pile.cut_m3)
    piles = [item.pile for item in found if item.pile.reason is None]
    others = [item.pile for item in found if item.pile.reason is not None]
    return _numbered(piles), _numbered(others), tuple(item.outline for item in found)


def _numbered(items: list[Pile]) -> tuple[Pile, ...]:
    return tuple(dataclasses.replace(item, id=i) for i, item in enumerate(items, start=1))


def _pile(  # noqa: PLR0913, PLR0917 - what there is to describe it by
    raw: _native.RawObject,
    measured: Measured,
    frame: Frame,
    rounding: Rounding,
    settings: Settings,
    registration: Registration | None,
) -> Pile:
    centroid_m, *outline_m = _in_scan([raw.centroid_m, *raw.outline_m], frame)
    factor = settings.stages.factor
    own = {term: factor * u_m3 for term, u_m3 in raw.budget.items()}
    budget = Budget(**own, rounding_m3=factor * rounding.u_m3(raw))
    if registration is not None and not measured.spread.edges_m:
        registration_m3 = factor * _registration_m3(raw, registration)
        footprint_m3 = budget.footprint_m3 * _toe_share(raw, registration, settings)
        budget = replace(budget, registration_m3=registration_m3, footprint_m3=footprint_m3)
    volume = factor * (raw.cut_m3 - raw.fill_m3)
    region = measured.regions[raw.label] if measured.regions else None
    material = region.material if region else None
    mass, u_mass = mass_kg(volume, budget.combined_m3(), density_of(material, settings))
    return Pile(
        id=0,
        volume_m3=volume,
        u95_m3=COVERAGE * budget.combined_m3(),
        cut_m3=factor * raw.cut_m3,
        fill_m3=factor * raw.fill_m3,
        footprint_m2=raw.footprint_m2,
        max_height_m=raw.max_height_m,
        centroid_m=centroid_m,
        outline_m=tuple(outline_m),
        seen_fraction=raw.seen_fraction,
        touches_edge=raw.touches_edge,
        leans_on_wall=raw.leans_on_wall,
        mass_kg=mass,
        u95_mass_kg=None if u_mass is None else COVERAGE * u_mass,
        base=settings.base.partition("=")[0],
        base_from=raw.base_from if settings.base == "local" else None,
        budget=budget,
        volume_by_base_m3=_by_base(raw, measured, factor),
        name=region.name if region else None,
        material=material or settings.material,
        reason=raw.reason,
    )


def _registration_m3(raw: _native.RawObject, found: Registration) -> float:
    """Return a volume's standard uncertainty due to registration, estimated from the frames."""
    height_m3 = raw.footprint_m2 * _u_height_m(raw, found)
    return math.hypot(height_m3, found.u_scale * (raw.cut_m3 - raw.fill_m3))


def _u_height_m(raw: _native.RawObject, found: Registration) -> float:
    """Return the standard uncertainty of a pile's mean height, averaged over places in it."""
    places = max(1.0, raw.footprint_m2 / found.place_m**2)
    return math.hypot(found.u_height_m, found.u_place_m / math.sqrt(places))


def _toe_share(raw: _native.RawObject, found: Registration, settings: Settings) -> float:
    """Return the share of the toe that is uncertain.

    If heights are u too high, a wedge as high as the margin, of known angle, holds 2 u / margin
    more. Where a wall ends the pile, the face is uncertain too, and the whole share is returned.
    """
    if raw.leans_on_wall:
        return 1.0
    u_m = math.hypot(found.u_height_m, found.u_place_m)
    return min(1.0, 2.0 * u_m / given(settings.margin_m))


def _in_scan(places_m: list[Position], frame: Frame) -> list[Position]:
    return [(x, y, z) for x, y, z in frame.to_scan(np.array(places_m)).tolist()]


def _by_base(raw: _native.RawObject, measured: Measured, factor: float) -> dict[str, float] | None:
    if not raw.compared_m3:
        return None
    volumes = (factor * volume for volume in raw.compared_m3)
    return dict(zip(measured.compared, volumes, strict=True))


def doubts(
    piles: tuple[Pile, ...], others: tuple[Pile, ...], pose: Pose, points: int, settings: Settings
) -> list[str]:
    """Return what a user should know before trusting the numbers."""
    found = []
    if not piles:
        nothing = (
            f"nothing of {settings.stages.min_cluster_size} cells or more stands higher than "
            f"margin_m = {settings.margin_m:.2g} above the ground"
        )
        what = f"{len(others)} other objects were found" if others else nothing
        found.append(f"no pile was found: {what}")
    share = pose.plane.inliers / points
    if share < FLAT_SHARE and not settings.has_earlier:
        found.append(f"only {share:.0%} of the points lie on one plane: the ground may be uneven")
    found += [
        f"object {item.id} may be a pile, but only {item.seen_fraction:.0%} of it were seen: "
        "its volume is an estimate and not in the total"
        for item in others
        if item.reason == TOO_LITTLE_SEEN
    ]
    for pile in piles:
        found += _doubts_of(pile, settings)
    unknown = {pile.material for pile in piles if pile.material and pile.mass_kg is None}
    found += [
        f"the density of {name!r} is not known: no mass is given (see `divespot materials`)"
        for name in sorted(filter(None, unknown))
    ]
    if settings.density_kg_m3 is not None and not settings.density_u_kg_m3:
        found.append("the density was taken as exact: density_u_kg_m3 is its standard uncertainty")
    return found


def _doubts_of(pile: Pile, settings: Settings) -> list[str]:
    found = []
    if pile.touches_edge:
        found.append(f"pile {pile.id} runs out of the scan: the part beyond is not counted")
    if pile.base_from == "ground":
        found.append(
            f"the base of pile {pile.id} is the scene's ground: no ground was seen around it"
        )
    # A height that was given may well lie off the ground.
    own = settings.base == "local" or pile.base == "height"
    if not own and pile.budget.base_m3 > OFF_SHARE * abs(pile.volume_m3):
        off_m = pile.budget.base_m3 / pile.footprint_m2
        found.append(
            f"the ground around pile {pile.id} lies about {off_m:.2g} m off the base "
            f"{settings.base}: was another one meant?"
        )
    return found
