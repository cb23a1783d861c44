"""Helpers for tests of reports."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import jsonschema

if TYPE_CHECKING:
    from divespot import Pile, Report


@cache
def contract() -> jsonschema.Draft202012Validator:
    """Return a validator for the JSON Schema in the package."""
    text = (files("divespot") / "report.schema.json").read_text(encoding="utf-8")
    return jsonschema.Draft202012Validator(json.loads(text))


def require_contract(report: Report) -> None:
    """Fail unless a report's JSON keeps the contract."""
    contract().validate(json.loads(report.to_json()))


def objects(report: Report) -> tuple[Pile, ...]:
    """Return all that stands on the ground."""
    return report.piles + report.other_objects


def volume_m3(report: Report) -> float:
    """Return the volume of the only object."""
    (only,) = objects(report)
    return only.volume_m3


def result(report: Report) -> dict[str, Any]:
    """Return the values that must be bit-identical: all except times and number of threads.

    The report's JSON is validated against the schema.
    """
    require_contract(report)
    found = report.to_dict()
    del found["timings_s"], found["settings"]["threads"]
    return found
