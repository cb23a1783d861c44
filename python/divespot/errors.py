"""What divespot raises."""

from __future__ import annotations

import re
from typing import Literal, TypeAlias

#: Most characters of a message: no terminal line and no log wants more.
LONGEST = 500

#: What became of a scan, for a supervisor: with piles, without, or not measured and why.
Status: TypeAlias = Literal["measured", "no_pile", "no_ground", "nothing_seen", "bad_input"]

_BREAKS = re.compile(r"\s*[\n\r\t\v\f]\s*")


class DivespotError(ValueError):
    """Bad input: one sentence that says what was given and what is needed."""

    status: Status = "bad_input"

    def __init__(self, sentence: object = "") -> None:
        super().__init__(shortened(printable(str(sentence))))


class NoGroundError(DivespotError):
    """The scan shows no ground that piles could stand on, or not which side of it is up."""

    status: Status = "no_ground"


class NoFloorError(NoGroundError):
    """The scan shows slopes alone, or what stands on something: no floor for piles."""


class NothingSeenError(DivespotError):
    """Nothing is left of the scan: it is empty, or all its points mean no data."""

    status: Status = "nothing_seen"


def printable(text: str) -> str:
    """Return text on one line, without what would steer a terminal."""
    line = _BREAKS.sub(" ", text)
    return "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in line)


def encodable(text: str | None) -> str | None:
    """Return text that UTF-8 can hold: names of files need be none."""
    return None if text is None else text.encode("utf-8", "replace").decode()


def shortened(text: str, most: int = LONGEST) -> str:
    """Return a text without its middle where it is longer than `most` characters."""
    if len(text) <= most:
        return text
    end = most // 2
    return f"{text[: most - end - 3]}...{text[-end:]}"
