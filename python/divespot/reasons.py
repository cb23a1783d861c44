"""Why something that was found is not counted: it is no pile, or may be no change."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias

#: Each is told in `docs/method.md`. The first eight are the kernel's (`piles/reason.rs`).
Reason: TypeAlias = Literal[
    "thin",
    "steep sides",
    "beside a shadow",
    "floating",
    "apart from the ground",
    "too little seen",
    "cut off by the scan's edge",
    "not clear of the ground",
    "hole",
    "below the level of detection",
    "stands in both surveys",
    "at the edge of what was seen",
]

THIN: Final = "thin"
TOO_LITTLE_SEEN: Final = "too little seen"
NOT_CLEAR: Final = "not clear of the ground"

#: The difference of a place may be zero.
NOT_DETECTED: Final = "below the level of detection"

#: Something stands in both surveys, but only the surface of one survey runs over it.
IN_BOTH: Final = "stands in both surveys"

#: The difference of a place is only at the end of a scan.
AT_EDGE: Final = "at the edge of what was seen"
