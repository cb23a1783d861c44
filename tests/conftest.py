"""Fixtures that several test files share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

REAL_SCANS = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="module", autouse=True)
def _forget(request: pytest.FixtureRequest) -> Iterator[None]:
    """Let go of the scans and reports that the tests of a file share, once they have run."""
    yield
    for shared in vars(request.module).values():
        if hasattr(shared, "cache_clear"):
            shared.cache_clear()


@pytest.fixture
def real_scan() -> Callable[[str], Path]:
    """Return the path of a real scan by its name, or skip where it is absent."""

    def find(name: str) -> Path:
        path = REAL_SCANS / name
        if not path.is_file():
            pytest.skip(f"the real scan {name} is not there ({REAL_SCANS})")
        return path

    return find
