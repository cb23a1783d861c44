"""The texts of reports: one JSON file per language."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any

LANGUAGE = "en"


@cache
def texts(language: str = LANGUAGE) -> dict[str, Any]:
    """Return all texts of a language."""
    found = files("divespot.results").joinpath("texts", f"{language}.json").read_text("utf-8")
    return dict(json.loads(found))
