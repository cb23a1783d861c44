"""What docs/method.md says must be what the code has."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import get_args

import pytest

from divespot.budget import Budget
from divespot.report import COMMON
from divespot.up import UpFrom

DOCS = Path(__file__).resolve().parents[1] / "docs"
METHOD = (DOCS / "method.md").read_text(encoding="utf-8")
BINDING = DOCS.parent / "rust" / "divespot-py" / "src" / "piles.rs"


def rows(heading: str) -> list[list[str]]:
    """The cells of the table under a heading, without quotes."""
    (table,) = re.findall(rf"^\| {heading} \|.*\n\|[-|]+\n((?:\|.*\n)+)", METHOD, re.MULTILINE)
    lines = table.replace("`", "").splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_the_budget_has_these_terms() -> None:
    terms = rows("term")
    assert [row[0] for row in terms] == [item.name for item in dataclasses.fields(Budget)]
    assert {row[0] for row in terms if row[3] == "yes"} == set(COMMON)


def test_these_are_the_reasons() -> None:
    reasons = re.findall(
        r'(?:Reason::\w+ => |reason: Some\()"(.+)"', BINDING.read_text(encoding="utf-8")
    )
    assert sorted(row[0] for row in rows("`reason`")) == sorted(reasons)


def test_up_is_taken_from_this() -> None:
    assert sorted(row[2] for row in rows("evidence")) == sorted(get_args(UpFrom))


PICTURES = re.findall(r"!\[.+\]\((.+)\)", METHOD)


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_small(name: str) -> None:
    assert 5_000 < (DOCS / name).stat().st_size < 90_000


def test_every_picture_is_shown() -> None:
    drawn = sorted(path.name for path in DOCS.glob("method-*.png"))
    assert drawn == sorted(PICTURES)
