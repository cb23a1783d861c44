"""The copy of the sources in which all mutants are: rewritten and built once."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from mutants import of_python
from mutants.of_rust import Constants

ROOT = Path(__file__).resolve().parents[2]
PLACE = ROOT / "target" / "mutants"
COPY = PLACE / "copy"
UNIT_TESTS = PLACE / "unit-tests"
PROFILE = ("lto=false", "codegen-units=256", "incremental=true", "opt-level=1", "strip=false")
RELEASE = [
    "--release",
    *(part for each in PROFILE for part in ("--config", f"profile.release.{each}")),
]
#: What builds the copy, and runs it.
ENVIRONMENT = os.environ | {
    "CARGO_TARGET_DIR": str(PLACE / "build"),
    "RUSTFLAGS": "-Awarnings",
    "PYO3_PYTHON": sys.executable,
    "PYTHONPATH": f"{COPY / 'python'}:{ROOT / 'benches'}",
    "PYTHONDONTWRITEBYTECODE": "1",
}


def build(*, unit: bool) -> list[str]:
    """Copy, rewrite and build, for the core's unit tests alone or all; return the constants."""
    copy()
    constants = Constants(COPY)
    constants.settle(["cargo", "check", "--tests"], ENVIRONMENT)
    for name, path in sorted(constants.left_out, key=str):
        where = path.relative_to(COPY) if path else "where it is public"
        print(f"not tried, since no function can stand for it: {name}, {where}")
    tests = cargo("test", "--no-run", "--lib")
    UNIT_TESTS.unlink(missing_ok=True)
    shutil.copy2(next(m["executable"] for m in tests if m.get("executable")), UNIT_TESTS)
    names = constants.names
    if not unit:
        made = cargo("build", "--package", "divespot-py")
        library = next(m for m in made if m.get("target", {}).get("name") == "_native")
        shutil.copy2(library["filenames"][0], COPY / "python" / "divespot" / "_native.abi3.so")
        names = names + of_python.write(COPY)
    (PLACE / "names.json").write_text(json.dumps(names))
    return names


def copy() -> None:
    """Copy all files but those that git ignores."""
    shutil.rmtree(COPY, ignore_errors=True)
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.check_output(command, cwd=ROOT, text=True).splitlines()
    for name in filter(lambda name: (ROOT / name).is_file(), listed):
        (COPY / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, COPY / name)
    workspace = COPY / "Cargo.toml"
    workspace.write_text(workspace.read_text().replace(', "benches"]', "]"))


def cargo(*arguments: str) -> list[dict[str, Any]]:
    """Return cargo's messages."""
    command = ["cargo", *arguments, *RELEASE, "--message-format=json"]
    told = subprocess.check_output(command, cwd=COPY, env=ENVIRONMENT, text=True)
    return [json.loads(line) for line in told.splitlines()]


def chosen(name: str, sign: str, names: list[str]) -> str:
    """Return what the environment calls a mutant: by number in Rust, by name in Python."""
    return sign + (str(names.index(name)) if ".rs " in name else name)
