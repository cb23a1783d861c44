"""What a measurement would take on boards that are not at hand: `make boards` prints an estimate.

Counts the instructions of `divespot measure` on one thread under callgrind, start and imports
apart, and divides them by what each core is assumed to do in a second. aarch64 needs about as many
instructions as x86-64.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

SCENE = "three-piles"
START = "from divespot.cli import main; from divespot.pipeline import measure"


@dataclass(frozen=True)
class Board:
    """A core, its clock, and the instructions a cycle that are assumed of it."""

    name: str
    core: str
    clock_ghz: float
    a_cycle: float

    def seconds(self, instructions: int) -> float:
        """Return the time that so many instructions take."""
        return instructions / (1e9 * self.clock_ghz * self.a_cycle)


BOARDS = (
    Board("Jetson Nano", "Cortex-A57", 1.43, 1.0),
    Board("Raspberry Pi 5", "Cortex-A76", 2.4, 1.8),
    Board("Jetson Orin Nano", "Cortex-A78AE", 1.5, 2.0),
    Board("Jetson AGX Orin", "Cortex-A78AE", 2.2, 2.0),
)


def counted(*arguments: str) -> int:
    """Return the number of instructions of a Python program, its modules compiled beforehand."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    python = (sys.executable, *arguments)
    subprocess.run(python, check=True, capture_output=True, env=environment)
    with tempfile.NamedTemporaryFile() as profile:
        valgrind = ("valgrind", "--tool=callgrind", f"--callgrind-out-file={profile.name}")
        command = (*valgrind, *python)
        subprocess.run(command, check=True, capture_output=True, env=environment)
        totals = re.findall(
            r"^(?:summary|totals): (\d+)", Path(profile.name).read_text(), re.MULTILINE
        )
    return int(totals[-1])


def main() -> None:
    """Count, and print a line a board."""
    if shutil.which("valgrind") is None:
        sys.exit("boards: valgrind counts the instructions: install it (apt-get install valgrind)")
    divespot = ("-m", "divespot")
    with tempfile.TemporaryDirectory() as folder:
        scan = str(Path(folder) / "scan.ply")
        simulate = (sys.executable, *divespot, "simulate", SCENE, "--output", scan)
        subprocess.run(simulate, check=True, capture_output=True)
        start = counted("-c", START)
        whole = counted(*divespot, "measure", scan, "--json", "-", "--threads", "1")
        header = Path(scan).read_bytes()[:500].decode("ascii", "replace")
    points = int(re.findall(r"element vertex (\d+)", header)[0])
    work = whole - start
    print(f"{points:,} points as PLY: {work / 1e9:.2f} billion instructions,")
    print(f"start and imports of {start / 1e9:.2f} billion apart\n")
    print("| board | core, clock | assumed a cycle | estimate, one thread |\n|---|---|--:|--:|")
    for board in BOARDS:
        core = f"{board.core}, {board.clock_ghz:g} GHz"
        print(f"| {board.name} | {core} | {board.a_cycle} | {board.seconds(work):.2g} s |")


if __name__ == "__main__":
    main()
