"""Errors in one form: what was given, and what is needed."""

from __future__ import annotations

import ast
import re

import pytest

from imports import PYTHON, RUST

RAISED = {"DivespotError", "NothingSeenError", "NoGroundError", "UsageError", "BadParameter"}
TEXT = r'\s*"((?:[^"\\]|\\.)*)"'
#: Errors of the core and of the binding that are given a whole sentence.
WHOLE = re.compile(rf"(?:Error::Degenerate\(|new_err\((?:format!\()?){TEXT}", re.DOTALL)


def sentences(text: str) -> set[str]:
    """Return the literal words of the errors that a file makes, with {} for values."""
    return {
        "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in parts)
        for call in ast.walk(ast.parse(text))
        if isinstance(call, ast.Call)
        and call.args
        and getattr(call.func, "attr", getattr(call.func, "id", "")) in RAISED
        for given in call.args[:1]
        for parts in [given.values if isinstance(given, ast.JoinedStr) else [given]]
    }


def test_every_error_of_the_package_says_what_is_needed() -> None:
    found = set().union(*(sentences(p.read_text("utf-8")) for p in PYTHON.rglob("*.py")))
    assert len(found) > 200
    # A value at the end is another sentence that is passed on, or says what is needed.
    assert {one for one in found if "needed" not in one and not one.endswith("{}")} == set()


@pytest.mark.parametrize("crate", ["divespot-core", "divespot-py"])
def test_every_whole_sentence_of_the_core_says_what_is_needed(crate: str) -> None:
    sources = [p.read_text("utf-8") for p in RUST.parents[1].joinpath(crate).rglob("*.rs")]
    found = {sentence for text in sources for sentence in WHOLE.findall(text)}
    assert len(found) > 5
    assert {sentence for sentence in found if "needed" not in sentence} == set()
