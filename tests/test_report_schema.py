"""Every report keeps the contract in report.schema.json, and the pages made from it are current."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import numpy as np
import pytest

import divespot
from divespot import Settings
from reports import require_contract
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from types import ModuleType

ROOT = Path(__file__).resolve().parents[1]
CONE = sampled(SOLIDS["cone"], 2.0**-5)
SQUARE = [[-0.8, -0.8], [0.8, -0.8], [0.8, 0.8], [-0.8, 0.8], [-0.8, -0.8]]
OUTLINE = {"type": "Polygon", "coordinates": [SQUARE]}


def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("fields", ROOT / "docs" / "fields.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_schema_and_pages_are_current() -> None:
    for path, text in maker().written().items():
        assert path.read_text(encoding="utf-8") == text, f"run make docs-fields for {path.name}"


def test_the_schema_is_one() -> None:
    jsonschema.Draft202012Validator.check_schema(maker().schema())


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"material": "corn", "compare_bases": True, "crop": (-9, -9, -9, 9, 9, 9)},
        {"outline": OUTLINE, "up": (0, 0, 1), "base": "height=0"},
        {"repeat": True, "columns": "1,2,3", "classes": "2,6"},
        vars(Settings.paper()),
    ],
)
def test_reports_keep_the_contract(changes: dict[str, Any]) -> None:
    require_contract(divespot.measure(CONE, changes))


def test_other_objects_keep_the_contract() -> None:
    hole = np.where(np.hypot(CONE[:, 0], CONE[:, 1]) < 0.3, -0.2, 0.0)
    report = divespot.measure(np.column_stack([CONE[:, :2], hole]), up="z")
    require_contract(report)
    assert report.other_objects


def test_the_contract_refuses_what_it_does_not_know() -> None:
    told = json.loads(divespot.measure(CONE).to_json())
    validator = jsonschema.Draft202012Validator(maker().schema())
    changes: list[dict[str, Any]] = [{"more": 1}, {"seed": "one"}, {"piles": [{}]}]
    for change in changes:
        assert not validator.is_valid(told | change)
    assert validator.is_valid(told)
