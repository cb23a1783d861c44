"""What is measured in scenes of exact arithmetic stays the same to the last bit."""

from __future__ import annotations

import json

import pytest

from pinned import KEPT, SCANS, SEQUENCES, figures


@pytest.mark.parametrize("name", [*SCANS, *SEQUENCES])
def test_every_figure_is_what_it_was(name: str) -> None:
    """Where a change is meant, `python tests/pinned.py` writes the new figures."""
    assert figures(name) == json.loads(KEPT.read_text())[name]
