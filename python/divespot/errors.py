"""The errors that divespot raises."""

from __future__ import annotations

import re
from typing import Literal, TypeAlias

#: Most characters of a message, so that it fits in a log line.
LONGEST = 500

#: Outcome of a scan, for a supervisor: measured, no pile, or why it was not measured.
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
    """The scan shows only slopes or objects: no floor on which piles could stand."""


class NothingSeenError(DivespotError):
    """No usable point is left: the scan is empty, or all its points mean no data."""

    status: Status = "nothing_seen"


def damaged(what: str) -> DivespotError:
    """Return the error of a file that does not hold what its kind holds."""
    return DivespotError(f"{what}: an intact file is needed, not a truncated or corrupt one")


def unreadable(path: object, error: BaseException) -> DivespotError:
    """Return the error of a file that the system does not give."""
    return DivespotError(f"{path}: cannot be read ({_reason(error)}): a readable file is needed")


def unwritable(path: object, error: BaseException) -> DivespotError:
    """Return the error of a file that the system does not take."""
    return DivespotError(f"{path}: cannot be written ({_reason(error)}): another place is needed")


def _reason(error: BaseException) -> object:
    return getattr(error, "strerror", None) or error


def printable(text: str) -> str:
    """Return text on one line, without characters that control a terminal."""
    line = _BREAKS.sub(" ", text)
    return "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in line)


def encodable(text: str | None) -> str | None:
    """Return text that UTF-8 can encode: file names may contain other bytes."""
    return None if text is None else text.encode("utf-8", "replace").decode()


def shortened(text: str, most: int = LONGEST) -> str:
    """Return a text with its middle left out if it is longer than `most` characters."""
    if len(text) <= most:
        return text
    end = most // 2
    return f"{text[: most - end - 3]}...{text[-end:]}"
