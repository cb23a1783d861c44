"""Names in the core: a local is not named as the function that it calls."""

from __future__ import annotations

import re

from imports import RUST

SHADOW = re.compile(r"\blet (?:mut )?(\w+)(?:: [^=;]+?)? = &?\1\(")


def test_no_local_hides_the_function_that_it_calls() -> None:
    found = {
        f"{path.relative_to(RUST)}: {match.group(1)}"
        for path in RUST.rglob("*.rs")
        for match in SHADOW.finditer(path.read_text(encoding="utf-8"))
    }
    assert found == set()
