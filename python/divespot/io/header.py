"""Text headers before a body that may be binary."""

from __future__ import annotations

import re
from dataclasses import dataclass

_MAX_HEADER_BYTES = 1 << 20
_LINE_END = re.compile(rb"\r\n|\n|\r")
_LINE_END_TEXT = re.compile(r"\r\n|\n|\r")


@dataclass(frozen=True)
class TextHeader:
    """A header: its lines except the last, the match of its last line, and the body's offset."""

    lines: list[str]
    word: str
    size: int


def find_header(data: bytes, last_line: bytes) -> TextHeader | None:
    """Return the header that ends with a line like the pattern `last_line`; None if there is none.

    Lines may end in LF, CR LF or CR. The end of the first line decides whether an LF byte after
    the header is the second half of a CR LF or the first byte of the body.
    """
    pattern = rb"(?:\A|[\r\n])[ \t]*" + last_line + rb"[ \t]*(?=[\r\n])"
    found = re.compile(pattern).search(data, 0, _MAX_HEADER_BYTES)
    first = _LINE_END.search(data, 0, _MAX_HEADER_BYTES)
    if found is None or first is None:
        return None
    lines = _LINE_END_TEXT.split(data[: found.start()].decode("utf-8", "replace"))
    word = found[1].decode("utf-8", "replace") if found.re.groups else ""
    both = first[0] == b"\r" and data[found.end() : found.end() + 2] == b"\r\n"
    end = found.end() + 1 if both else _end(data, found.end())
    return TextHeader(lines, word, end)


def _end(data: bytes, at: int) -> int:
    match = _LINE_END.match(data, at)
    return match.end() if match else at
