"""Which points of a LAS file are kept: by class, by return, and not withheld."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from divespot.errors import DivespotError
from divespot.io.wanted import NOISE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from divespot.io.wanted import Wanted


@dataclass
class LasFilter:
    """Filters batches of points, and counts what it leaves out."""

    wanted: Wanted
    unwanted: int = 0
    withheld: int = 0
    noise: int = 0
    seen_classes: Counter[int] = field(default_factory=Counter)

    def keeps(self, points: Any) -> NDArray[np.bool_]:  # noqa: ANN401 - laspy ships no types
        """Return which points of a batch are kept.

        Withheld points count as deleted (LAS 1.4 R15, table 16).
        """
        classes = np.asarray(points.classification)
        found, counts = np.unique(classes, return_counts=True)
        self.seen_classes.update(dict(zip(found.tolist(), counts.tolist(), strict=True)))
        withheld = np.asarray(points.withheld).astype(bool)
        if self.wanted.classes is None:
            noise, wanted = np.isin(classes, list(NOISE)), np.ones(len(classes), bool)
        else:
            noise, wanted = (
                np.zeros(len(classes), bool),
                np.isin(classes, list(self.wanted.classes)),
            )
        wanted &= self._returns(points)
        self.withheld += int(withheld.sum())
        self.noise += int((noise & ~withheld).sum())
        self.unwanted += int((~wanted & ~noise & ~withheld).sum())
        return np.asarray(wanted & ~noise & ~withheld)

    def _returns(self, points: Any) -> NDArray[np.bool_] | np.bool_:  # noqa: ANN401 - as above
        number = np.asarray(points.return_number)
        if self.wanted.returns == "first":
            return number <= 1
        if self.wanted.returns == "last":
            return number >= np.asarray(points.number_of_returns)
        return np.True_

    def told(self, kept: int) -> tuple[str, ...]:
        """Return how many points were left out and why, one sentence each.

        Raises
        ------
        DivespotError
            No point was kept.

        """
        left_out = (
            (self.withheld, "that are withheld"),
            (self.noise, "in the classes of noise, 7 and 18 (--classes keeps them)"),
            (self.unwanted, "outside the classes and returns that were asked for"),
        )
        told = tuple(f"{count} points {what} were left out" for count, what in left_out if count)
        if not kept and told:
            classes = ", ".join(map(str, sorted(self.seen_classes)))
            raise DivespotError(f"{'; '.join(told)}: others are needed, its classes are {classes}")
        return told
