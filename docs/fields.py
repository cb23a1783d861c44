"""Write the report's JSON Schema, the pages of its fields and of the settings, and the core's map.

The first three are made from the dataclasses: types, and the Attributes in the docstrings. The map
in DEVELOP.md has the first sentence of each file of the core.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import os
import re
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from divespot import Budget, Ground, Pile, Settings, Source, Stages, Total
from divespot.cli.options import GROUPS
from divespot.directions import Position
from divespot.level import Level
from divespot.reasons import Reason
from divespot.report import SCHEMA, BaseFrom, Report
from divespot.up import UpFrom

ROOT = Path(__file__).resolve().parents[1]
SCHEMA_FILE = ROOT / "python" / "divespot" / "report.schema.json"
CORE = ROOT / "rust" / "divespot-core" / "src"
DEVELOP = ROOT / "DEVELOP.md"
REPORT_PAGE = ROOT / "docs" / "report.md"
SETTINGS_PAGE = ROOT / "docs" / "settings.md"

#: Records of the report; each has a definition of that name in the JSON Schema.
RECORDS = (Source, Pile, Budget, Total, Ground, Settings, Stages)

#: Names in the records' annotations that are imported for type checking only.
NAMES = {record.__name__: record for record in (*RECORDS, Level)} | {
    "Mapping": Mapping,
    "NDArray": Any,
    "Position": Position,
    "BaseFrom": BaseFrom,
    "Reason": Reason,
    "UpFrom": UpFrom,
    "os": os,
}

MAP_BEGINS, MAP_ENDS = "<!-- made by make docs-fields -->", "<!-- end -->"

PLAIN = {str: "string", int: "integer", float: "number", bool: "boolean", type(None): "null"}

Json = dict[str, Any]


def attributes(record: type[Any]) -> dict[str, str]:
    """Return the description of each field of a record, from its docstring."""
    doc = inspect.cleandoc(record.__doc__ or "").partition("----------\n")[2]
    found = re.findall(r"^(\w+)\n((?:(?:    .*)?\n)+)", doc + "\n", re.MULTILINE)
    return {name: " ".join(text.split()).replace("``", "`") for name, text in found}


def schema_of(kind: Any) -> Json:  # noqa: ANN401 - a type, or what typing makes of types
    """Return the JSON Schema of a type."""
    if kind in PLAIN:
        return {"type": PLAIN[kind]}
    if dataclasses.is_dataclass(kind):
        return {"$ref": f"#/$defs/{kind.__name__}"}
    return {} if kind is Any else _made_of(typing.get_origin(kind), typing.get_args(kind))


def _made_of(origin: Any, args: tuple[Any, ...]) -> Json:  # noqa: ANN401 - as above
    if origin is Literal:
        return {"enum": list(args)}
    if origin in (typing.Union, types.UnionType):
        return _one_of([schema_of(arg) for arg in args if arg != os.PathLike[str]])
    if origin is tuple:
        return _array(args)
    return {"type": "object", "additionalProperties": schema_of(args[1])}


def _one_of(choices: list[Json]) -> Json:
    if all(list(choice) == ["type"] for choice in choices):
        return {"type": [choice["type"] for choice in choices]}
    return {"anyOf": choices}


def _array(args: tuple[Any, ...]) -> Json:
    found = {"type": "array", "items": schema_of(args[0])}
    if args[-1] is not Ellipsis:
        found |= {"minItems": len(args), "maxItems": len(args)}
    return found


def record_schema(record: type[Any], *, without: tuple[str, ...] = ()) -> Json:
    """Return the JSON Schema of a record."""
    said, hints = attributes(record), typing.get_type_hints(record, None, NAMES)
    names = [item.name for item in dataclasses.fields(record) if item.name not in without]
    fields = {name: {"description": said[name], **schema_of(hints[name])} for name in names}
    return _object(fields)


def _object(fields: Json) -> Json:
    return {
        "type": "object",
        "properties": fields,
        "required": list(fields),
        "additionalProperties": False,
    }


def schema() -> Json:
    """Return the JSON Schema of the report."""
    body = record_schema(Report, without=("scene",))["properties"]
    body["piles"] = body["piles"] | {"items": {"$ref": "#/$defs/Pile"}}
    body["other_objects"] = body["other_objects"] | {"items": {"$ref": "#/$defs/OtherObject"}}
    fields = {
        "schema": {"description": "Name and version of this contract.", "const": SCHEMA},
        "divespot": {"description": "Version of divespot.", "type": "string"},
        "status": {
            "description": "Outcome of the scan: `measured`, or `no_pile` if none was found.",
            "enum": ["measured", "no_pile"],
        },
        **body,
        "seed": {"description": "Seed of all random draws.", "type": "integer"},
    }
    records = {record.__name__: record_schema(record) for record in RECORDS}
    other = record_schema(Pile)
    said = attributes(Pile)["reason"]
    other["properties"]["reason"] = {"description": said, **schema_of(Reason)}
    records |= {"Pile": record_schema(Pile, without=("reason",)), "OtherObject": other}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": SCHEMA}
    return {**head, **_object(fields), "$defs": records}


def report_page() -> str:
    """Return the page of the report's fields."""
    whole = schema()
    parts = [
        ("The report", whole),
        ("`source`", whole["$defs"]["Source"]),
        ("`piles` and `other_objects`", whole["$defs"]["OtherObject"]),
        ("`budget` of a pile", whole["$defs"]["Budget"]),
        ("`total`", whole["$defs"]["Total"]),
        ("`ground`", whole["$defs"]["Ground"]),
    ]
    text = (
        "# The report\n\n"
        "`divespot measure SCAN --json -` prints one JSON object; in Python, `Report.to_dict()` "
        "returns the same. The contract is the JSON Schema "
        "`divespot/report.schema.json`, against which the tests validate every report; this "
        "page is made from the same source by `make docs-fields`. Numbers that are not finite "
        "are null.\n\n"
        "Units are in the names: `_m`, `_m2`, `_m3`, `_kg`, `_deg`, `_s`; `u95_` is an expanded "
        "uncertainty of 95 %. Budget terms are standard uncertainties. Positions (`centroid_m`, "
        "`outline_m`) are in the scan's own frame and unit.\n"
    )
    for title, part in parts:
        text += f"\n## {title}\n\n{_table(part['properties'])}"
    return text + "\nThe fields of `settings` are on the page of the [settings](settings.md).\n"


def _table(fields: Json) -> str:
    rows = (
        f"| `{name}` | {_kind(of)} | {_cell(of['description'])} |" for name, of in fields.items()
    )
    return "\n".join(["| field | type | meaning |", "|---|---|---|", *rows]) + "\n"


def _kind(of: Json) -> str:
    if "anyOf" in of:
        return " or ".join(_kind(one) for one in of["anyOf"])
    if "enum" in of or "const" in of:
        return "string"
    if "$ref" in of:
        return "object"
    kinds = of["type"] if isinstance(of["type"], list) else [of["type"]]
    return " or ".join(kinds)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def settings_page() -> str:
    """Return the page of the settings."""
    text = (
        "# Settings\n\n"
        "No setting is needed: those not given are derived from the scan. In Python they are "
        "keywords of `divespot.measure`, fields of `divespot.Settings`, or a dict; on the command "
        "line `cell_m` is `--cell-m` or `--cell`. A report holds the values used, and "
        '`measure(points, report_json["settings"])` measures with the same values again.\n'
    )
    of = {item.name: item for record in (Settings, Stages) for item in dataclasses.fields(record)}
    said = attributes(Settings) | attributes(Stages)
    for title, names in GROUPS.items():
        rows = (f"| `{n}` | {_cell(said[n])} |" for n in names if n in of)
        text += "\n".join([f"\n## {title}\n", "| setting | meaning |", "|---|---|", *rows]) + "\n"
    return text


def core_map() -> str:
    """Return DEVELOP.md with the map of the core, between two comments, made again."""
    paths = sorted(CORE.rglob("*.rs"), key=lambda path: (len(path.relative_to(CORE).parts), path))
    shown = (path for path in paths if "tests" not in path.with_suffix("").parts)
    rows = (
        f"| `{path.relative_to(CORE).as_posix()}` | {_first_sentence(path)} |" for path in shown
    )
    table = "\n".join(["| file | what it is |", "|---|---|", *rows])
    head, _, rest = DEVELOP.read_text(encoding="utf-8").partition(MAP_BEGINS)
    return f"{head}{MAP_BEGINS}\n{table}\n{MAP_ENDS}{rest.partition(MAP_ENDS)[2]}"


def _first_sentence(path: Path) -> str:
    """Return the first sentence of a file's module comment."""
    lines = re.match(r"(?://!.*\n)*", path.read_text(encoding="utf-8"))
    text = " ".join(line.removeprefix("//!").strip() for line in lines[0].splitlines())
    found = re.match(r".*?\.(?= [A-Z`]|$| )(?<!al\.)", text)
    return _cell(found[0] if found else text)


def main() -> None:
    """Write all files."""
    for path, text in written().items():
        path.write_text(text, encoding="utf-8")
        print(path.relative_to(ROOT))


def written() -> dict[Path, str]:
    """Return the new text of each file."""
    return {
        SCHEMA_FILE: json.dumps(schema(), indent=1) + "\n",
        REPORT_PAGE: report_page(),
        SETTINGS_PAGE: settings_page(),
        DEVELOP: core_map(),
    }


if __name__ == "__main__":
    main()
