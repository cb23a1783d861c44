"""What a program does in the contest, and the settings that all programs share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

MIN_NEIGHBORS = 10
MIN_CLUSTER_SIZE = 100
MIN_SAMPLES = 10
HYPOTHESES = 1000
#: divespot's voxels start this share of an edge below the points: the golden section.
ANCHOR = (3.0 - math.sqrt(5.0)) / 2.0


@dataclass(frozen=True)
class Task:
    """A program with its input loaded, in whatever form it wants it."""

    run: Callable[[], Any]
    """What is timed."""
    answer: Callable[[Any], Any]
    """Turns the result of `run` into plain numbers that can be compared; not timed."""
