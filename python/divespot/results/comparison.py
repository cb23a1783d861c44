"""The changes between two surveys: the comparison and its JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot import _native
from divespot.budget import COMMON
from divespot.report import COVERAGE, finite

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.detection import Spread
    from divespot.directions import Position
    from divespot.intake import Source
    from divespot.level import Level
    from divespot.reasons import Reason
    from divespot.report import Pile, Report
    from divespot.results.alignment import Alignment
    from divespot.results.sideways import Sideways
    from divespot.settings import Settings

SCHEMA = "divespot.comparison/1"


@dataclass(frozen=True)
class Change:
    """A volume that was gained or, if negative, lost.

    If no place is counted, the uncertainty is not known: `u95_m3` is NaN, null in the JSON.
    Changes below the level of detection may have happened.
    """

    volume_m3: float
    u95_m3: float

    @property
    def is_none(self) -> bool:
        """Whether no place is counted."""
        return math.isnan(self.u95_m3)


@dataclass(frozen=True)
class Place:
    """A place where the later scan differs from the earlier one by more than the detection limit.

    `gain_m3` is the volume above the earlier surface, `loss_m3` that below it; `net` is the
    difference, with its uncertainty including that of the alignment. A net change below
    `detection_m3` may be no change. `piles` are the later survey's piles at the place,
    `piles_before` the earlier one's. `reason` says why a place is not counted. Positions are in the
    scan's frame.
    """

    id: int
    gain_m3: float
    loss_m3: float
    net: Change
    detection_m3: float
    area_m2: float
    max_height_m: float
    centroid_m: Position
    outline_m: tuple[Position, ...]
    touches_edge: bool
    piles: tuple[int, ...]
    piles_before: tuple[int, ...]
    reason: Reason | None = None


@dataclass(frozen=True)
class Match:
    """Overlapping piles of both surveys; either side may be empty.

    `change` is the difference of the two volumes, each above its own base; u95 adds in squares.
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


@dataclass(frozen=True, eq=False)
class Fit:
    """The alignment of two surveys.

    Attributes
    ----------
    alignment
        Vertical alignment, on ground that did not change.
    sideways
        Alignment in x and y, on piles that did not change; None if there are none.
    spread
        Differences of the surveys on ground that did not change.
    aligned
        Whether the earlier survey was raised and moved accordingly.

    """

    alignment: Alignment
    sideways: Sideways | None
    spread: Spread
    aligned: bool


@dataclass(frozen=True, repr=False)
class Comparison:
    """Two surveys of a site.

    `before` and `after` are their reports, None if no ground was in view; `settings` are those used
    to measure the change. `gain` is the sum of the places that gained, `loss` that of those that
    lost, `net` the sum of both; `not_counted` holds the other places, with the reason. `fit` is the
    alignment of the surveys. `scene` has the heights of the later scan and, as base, those of the
    earlier one.
    """

    before: Report | None
    after: Report | None
    sources: tuple[Source, Source]
    settings: Settings
    places: tuple[Place, ...]
    not_counted: tuple[Place, ...]
    piles: tuple[Match, ...]
    gain: Change
    loss: Change
    net: Change
    fit: Fit
    warnings: tuple[str, ...]
    scene: Level = field(repr=False, compare=False)

    @property
    def alignment(self) -> Alignment:
        """The vertical alignment of the surveys."""
        return self.fit.alignment

    @property
    def spread(self) -> Spread:
        """The differences of the surveys on ground that did not change."""
        return self.fit.spread

    @property
    def aligned(self) -> bool:
        """Whether the earlier survey was raised and moved."""
        return self.fit.aligned

    @property
    def shift_m(self) -> Position | None:
        """Offset of the earlier scan from the later one, in the scan's frame, in metres."""
        return shift_in_scan_m(self.fit, self.level)

    @property
    def level(self) -> Level:
        """The heights of the later scan and, as base, those of the earlier one."""
        return self.scene

    @property
    def source(self) -> Source:
        """The later scan's source: places are in its frame and unit."""
        return self.sources[1]

    @property
    def inputs(self) -> tuple[str | None, ...]:
        """Paths of all inputs, which no output may overwrite."""
        paths = (path for source in self.sources for path in (source.path, *source.files))
        return *paths, self.settings.outline if isinstance(self.settings.outline, str) else None

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
            "spread": dataclasses.asdict(self.spread),
            "piles": [{"state": one.state, **dataclasses.asdict(one)} for one in self.piles],
            "places": [dataclasses.asdict(place) for place in self.places],
            "not_counted": [dataclasses.asdict(place) for place in self.not_counted],
            "settings": dataclasses.asdict(self.settings),
            "warnings": list(self.warnings),
        }

    def to_json(self, *, indent: int | None = 1) -> str:
        """Return the comparison as one JSON object; NaN becomes null."""
        return json.dumps(finite(self.to_dict()), indent=indent, allow_nan=False)

    def _alignment(self) -> dict[str, Any]:
        found, beside = self.alignment, self.fit.sideways
        return {
            "aligned": self.aligned,
            "offset_m": found.offset_m,
            "u95_offset_m": COVERAGE * math.sqrt(float(found.covariance[0, 0])),
            "tilt": list(found.tilt),
            "shift_m": None if self.shift_m is None else list(self.shift_m),
            "u95_shift_m": None if beside is None else COVERAGE * beside.u_m,
            "blocks": found.blocks,
            "spread_m": found.spread_m,
        }


def shift_in_scan_m(fit: Fit, level: Level) -> Position | None:
    """Return the shift in x and y in the scan's frame; None if it is not known."""
    if fit.sideways is None:
        return None
    ends = level.frame.to_scan(np.array([(0.0, 0.0, 0.0), (*fit.sideways.shift_m, 0.0)]))
    x, y, z = ((ends[1] - ends[0]) * level.frame.metres).tolist()
    return x, y, z


def _survey(source: Source, report: Report | None) -> dict[str, Any]:
    total = None if report is None else dataclasses.asdict(report.total)
    return {"source": dataclasses.asdict(source), "total": total}


def changed(piles: Sequence[Pile], u_alignment_m3: float, u_beside_m3: float) -> Change:
    """Add up places: errors common to all linearly, the others in squares."""
    common = [sum(getattr(pile.budget, term) for pile in piles) for term in COMMON]
    own = dict.fromkeys(COMMON, 0.0)
    rest = [dataclasses.replace(pile.budget, **own).combined_m3() for pile in piles]
    u = math.hypot(*common, *rest, u_alignment_m3, u_beside_m3)
    return Change(sum(pile.volume_m3 for pile in piles), COVERAGE * u)
