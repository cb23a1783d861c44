"""The short name of a coordinate reference system."""

from __future__ import annotations

import re

_CODE = re.compile(r'(?:AUTHORITY|ID)\["EPSG",\s*"?(\d+)"?\]\s*\]\s*$')
_EPSG = re.compile(r"EPSG:(\d+)$")
_NAME = re.compile(r'^\s*\w+\["([^"]+)"')


def crs_name(text: str | None) -> str | None:
    """Return ``EPSG:code`` if a system (WKT, or a name) states it, otherwise its name."""
    if not text:
        return None
    code = epsg(text)
    if code is not None:
        return f"EPSG:{code}"
    named = _NAME.match(text)
    return named[1] if named else text


def epsg(text: str | None) -> int | None:
    """Return the EPSG code of a whole system, not of one of its parts."""
    found = text and (_CODE.search(text) or _EPSG.search(text))
    return int(found[1]) if found else None
