"""Fail when a kernel needs more instructions than it used to: a figure that noise cannot move.

Each kernel runs once, on 30,000 points and one thread, under callgrind. What it executes is
compared with `instructions.json`; more than 5 % above that fails. `--update` accepts what was
counted.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
ACCEPTED = HERE / "instructions.json"
TOLERANCE = 0.05
#: The function whose instructions count, those of all it calls included.
COUNTED = "*gate*counted*"
NO_VALGRIND = (
    "gate: valgrind is not installed, so no instruction was counted: install it (Debian, Ubuntu: "
    "apt-get install valgrind; Fedora: dnf install valgrind) and run this again"
)


def main() -> int:
    """Count, compare, print; return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--update", action="store_true", help="write what was counted")
    update = parser.parse_args().update
    if shutil.which("valgrind") is None:
        sys.stderr.write(f"{NO_VALGRIND}\n")
        return 2
    program = build()
    names = output(program).split()
    counted = {name: instructions(program, name) for name in names}
    if update:
        ACCEPTED.write_text(
            json.dumps({"rustc": rustc(), "instructions": counted}, indent=2) + "\n"
        )
    return compare(json.loads(ACCEPTED.read_text()), counted)


def build() -> str:
    """Compile the program that runs one kernel, and return its path."""
    command = [
        "cargo",
        "build",
        "--profile",
        "bench",
        "--example",
        "gate",
        "--message-format",
        "json",
    ]
    lines = output(*command, "--manifest-path", HERE / "Cargo.toml").splitlines()
    made = [json.loads(line).get("executable") for line in lines]
    return next(path for path in made if path)


def instructions(program: str, kernel: str) -> int:
    """Return the number of instructions that a kernel executes."""
    with tempfile.NamedTemporaryFile() as profile:
        valgrind = ("valgrind", "--tool=callgrind", f"--callgrind-out-file={profile.name}")
        output(*valgrind, "--quiet", f"--toggle-collect={COUNTED}", program, kernel)
        found = re.search(
            r"^(?:summary|totals): (\d+)", Path(profile.name).read_text(), re.MULTILINE
        )
    if found is None or found[1] == "0":
        raise SystemExit(f"gate: callgrind counted nothing in {COUNTED} of {kernel}")
    return int(found[1])


def compare(accepted: dict, counted: dict[str, int]) -> int:
    """Print a line a kernel; return 1 where one needs too many instructions or is not known."""
    if accepted["rustc"] != rustc():
        print(
            f"accepted with {accepted['rustc']}, counted with {rustc()}: compilers differ a little"
        )
    print(f"{'kernel':22}{'accepted':>16}{'counted':>16}{'change':>9}")
    worse = [
        name for name in counted if not line(name, accepted["instructions"].get(name), counted)
    ]
    if worse:
        print(f"too many instructions: {', '.join(worse)}; --update accepts them")
    return int(bool(worse))


def line(name: str, before: int | None, counted: dict[str, int]) -> bool:
    """Print a kernel's line; return whether it passes."""
    if before is None:
        print(f"{name:22}{'none':>16}{counted[name]:>16,}")
        return False
    change = counted[name] / before - 1
    print(f"{name:22}{before:>16,}{counted[name]:>16,}{change:>+9.1%}")
    return change <= TOLERANCE


def rustc() -> str:
    """Return the compiler's name and version."""
    return " ".join(output("rustc", "--version").split()[:2])


def output(*command: str | Path) -> str:
    """Run a command and return what it prints; its complaints go to stderr."""
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


if __name__ == "__main__":
    sys.exit(main())
