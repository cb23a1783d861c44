"""What divespot raises."""

from __future__ import annotations

import re

#: Most characters of a message: no terminal line and no log wants more.
LONGEST = 500

_BREAKS = re.compile(r"\s*[\n\r\t\v\f]\s*")


class DivespotError(ValueError):
    """Bad input: one sentence that says what was given and what is needed."""

    def __init__(self, sentence: object = "") -> None:
        super().__init__(shortened(printable(str(sentence))))


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
