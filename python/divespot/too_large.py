"""Which scans are too large for memory."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING, Any

from divespot.errors import DivespotError
from divespot.io.files import require_regular
from divespot.io.las import points_promised
from divespot.io.las_sample import ANY_SIZE, SIGNATURE
from divespot.io.merge import paths_of
from divespot.io.wanted import Wanted
from divespot.io.web import is_url
from divespot.narrowing import plan_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from divespot.settings import Settings

#: Scans with more points are streamed. Measuring in memory takes 120 bytes per point: with this
#: many points, it stays within 1 GiB.
MOST_HELD = 2**23

#: Size in bytes of the longest LAS header, up to its count of points.
_HEADER_BYTES = 255


def is_too_large(source: Any, settings: Settings) -> bool:  # noqa: ANN401 - what a user gives
    """Return whether these are LAS files with more points than are held in memory.

    The paper's method needs every point and is never streamed.
    """
    if settings.stages.ground_form == "level" or settings.columns is not None:
        return False
    paths = paths_of(source)
    counts = [_count(path) for path in paths]
    if None in counts or sum(filter(None, counts)) <= MOST_HELD:
        return False
    wanted = wanted_of(settings)
    return wanted.plan is None or _in_plan(paths, wanted) > MOST_HELD


def wanted_of(settings: Settings) -> Wanted:
    """Return what is to be read of the files of a survey."""
    chosen = settings.columns, settings.classes, settings.returns, settings.crs
    return Wanted.of(*chosen, plan_of(settings))


def _in_plan(paths: Sequence[str], wanted: Wanted) -> int:
    """Return how many points are read of what a crop or outlines leave: of COPC files, not all."""
    from divespot.io.las_stretches import stretches_of  # noqa: PLC0415 - for crops alone

    try:
        parts = [stretches_of(path, wanted) for path in paths]
    except DivespotError:
        return 0  # reading it in full will raise the error
    return sum(stretch.count for some in parts for stretch in some)


def _count(path: str) -> int | None:
    """Return the number of points that a LAS header states; None for other files."""
    try:
        if is_url(path):
            return None
        require_regular(Path(path), ANY_SIZE)
        with Path(path).open("rb") as stream:
            head = stream.read(_HEADER_BYTES)
        return points_promised(head) if head.startswith(SIGNATURE) else None
    except (OSError, DivespotError, IndexError, struct.error):
        return None  # what reads it in full says why
