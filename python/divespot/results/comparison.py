"""What changed between two surveys: the comparison and its JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from divespot import _native
from divespot.report import COMMON, COVERAGE, finite

if TYPE_CHECKING:
    from divespot.directions import Position
    from divespot.intake import Source
    from divespot.report import Pile, Report
    from divespot.results.alignment import Alignment
    from divespot.settings import Settings

SCHEMA = "divespot.comparison/1"


@dataclass(frozen=True)
class Change:
    """A volume that was gained or, with a minus, lost."""

    volume_m3: float
    u95_m3: float


@dataclass(frozen=True)
class Place:
    """A place where the later scan differs from the earlier one by more than can be told apart.

    `gain_m3` lies above the earlier surface, `loss_m3` below it; `net` is the one less the other,
    with its uncertainty, that of the alignment included. `piles` are those of the later survey
    that lie there, `piles_before` those of the earlier one. Positions are in the scan's frame.
    """

    id: int
    gain_m3: float
    loss_m3: float
    net: Change
    area_m2: float
    max_height_m: float
    centroid_m: Position
    outline_m: tuple[Position, ...]
    touches_edge: bool
    piles: tuple[int, ...]
    piles_before: tuple[int, ...]


@dataclass(frozen=True)
class Match:
    """Piles of both surveys that lie on each other; either side may be empty.

    `change` is the difference of the two volumes, each above its own base; u95 adds up in squares.
    """

    before: tuple[int, ...]
    after: tuple[int, ...]
    volume_before_m3: float
    volume_after_m3: float
    change: Change

    @property
    def state(self) -> str:
        """Whether the pile is new, gone, or in both surveys."""
        return "in both" if self.before and self.after else "new" if self.after else "gone"


@dataclass(frozen=True)
class Comparison:
    """Two surveys of a place.

    `before` and `after` are their reports, None where no ground was in view; `settings` are those
    with which the change was measured.
    `gain` are the places that gained, `loss` those that lost, `net` both. `aligned` says whether
    the earlier scan was raised so that stable ground lies on stable ground.
    """

    before: Report | None
    after: Report | None
    sources: tuple[Source, Source]
    settings: Settings
    places: tuple[Place, ...]
    piles: tuple[Match, ...]
    gain: Change
    loss: Change
    net: Change
    alignment: Alignment
    aligned: bool
    warnings: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the comparison for JSON."""
        return {
            "schema": SCHEMA,
            "divespot": _native.__version__,
            "before": _survey(self.sources[0], self.before),
            "after": _survey(self.sources[1], self.after),
            "gain": dataclasses.asdict(self.gain),
            "loss": dataclasses.asdict(self.loss),
            "net": dataclasses.asdict(self.net),
            "detection_m": self.alignment.detection_m,
            "alignment": self._alignment(),
            "piles": [{"state": one.state, **dataclasses.asdict(one)} for one in self.piles],
            "places": [dataclasses.asdict(place) for place in self.places],
            "settings": dataclasses.asdict(self.settings),
            "warnings": list(self.warnings),
        }

    def to_json(self, *, indent: int | None = 1) -> str:
        """Return the comparison as one JSON object; what is not a number is null."""
        return json.dumps(finite(self.to_dict()), indent=indent, allow_nan=False)

    def _alignment(self) -> dict[str, Any]:
        found = self.alignment
        return {
            "aligned": self.aligned,
            "offset_m": found.offset_m,
            "u95_offset_m": COVERAGE * math.sqrt(float(found.covariance[0, 0])),
            "tilt": list(found.tilt),
            "blocks": found.blocks,
            "spread_m": found.spread_m,
        }


def _survey(source: Source, report: Report | None) -> dict[str, Any]:
    total = None if report is None else dataclasses.asdict(report.total)
    return {"source": dataclasses.asdict(source), "total": total}


def changed(piles: list[Pile], u_alignment_m3: list[float]) -> Change:
    """Add up places: what errs to the same side in all adds up linearly, the rest in squares."""
    common = [sum(getattr(pile.budget, term) for pile in piles) for term in COMMON]
    own = dict.fromkeys(COMMON, 0.0)
    rest = [dataclasses.replace(pile.budget, **own).combined_m3() for pile in piles]
    u = math.hypot(*common, *rest, sum(u_alignment_m3))
    return Change(sum(pile.volume_m3 for pile in piles), COVERAGE * u)
