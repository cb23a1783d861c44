"""What docs/method.md says must be what the code has."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import get_args

import pytest

from divespot.budget import COMMON, Budget
from divespot.reasons import Reason
from divespot.up import UpFrom

DOCS = Path(__file__).resolve().parents[1] / "docs"
METHOD = (DOCS / "method.md").read_text(encoding="utf-8")
REASONS = DOCS.parent / "rust" / "divespot-core" / "src" / "piles" / "reason.rs"


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
    told = [row[0] for row in rows("`reason`") + rows("reason")]
    assert sorted(told) == sorted(get_args(Reason))


def test_the_kernels_reasons_are_among_them() -> None:
    kernels = re.findall(r'Self::\w+ => "(.+)"', REASONS.read_text(encoding="utf-8"))
    assert tuple(kernels) == get_args(Reason)[: len(kernels)]


def test_up_is_taken_from_this() -> None:
    assert sorted(row[2] for row in rows("evidence")) == sorted(get_args(UpFrom))


PICTURES = re.findall(r"!\[.+\]\((.+)\)", METHOD)


@pytest.mark.parametrize("name", PICTURES)
def test_picture_is_small(name: str) -> None:
    assert 5_000 < (DOCS / name).stat().st_size < 90_000


def test_every_picture_is_shown() -> None:
    drawn = sorted(path.name for path in DOCS.glob("method-*.png"))
    assert drawn == sorted(PICTURES)
