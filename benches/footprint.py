"""What divespot takes on a board: `make footprint` prints it, and fails where a bound is passed.

Installs the wheel into an environment of its own, beside one that holds NumPy alone.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

#: Bounds. Wheel and install are wishes for boards; start and memory are measurements and a margin:
#: a quarter for the start, which varies, an eighth for memory.
MOST_WHEEL_MB = 2.0
MOST_INSTALL_MB = 60.0
MOST_START_S = 0.5
MOST_BYTES_A_POINT = 57.0

POINTS = 1_000_000
STARTS = 9

#: Prints the peak memory of a measurement, beyond what was held before it.
MEASURED = """
import resource, sys
import numpy as np
import divespot
from divespot import _native
_native.share_heap()  # as the command line does
count = int(sys.argv[1])
rng = np.random.default_rng(0)
points = np.empty((count, 3))
for part in np.array_split(points, 100):  # what is held meanwhile would hide a part of the peak
    part[:] = rng.uniform(0.0, 1.0, part.shape) * (30.0, 30.0, 0.01)
    x, y = part[:, 0] - 15.0, part[:, 1] - 15.0
    part[:, 2] += np.maximum(0.0, 3.0 - 0.5 * np.sqrt(x * x + y * y))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
divespot.measure(points)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


def run(*command: str | Path) -> str:
    """Run a program and return what it prints."""
    return subprocess.run(command, check=True, text=True, capture_output=True).stdout


def environment(folder: Path, what: str | Path) -> Path:
    """Install a package into an environment of its own; return its Python."""
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    run(python, "-m", "pip", "install", "--quiet", "--only-binary=:all:", what)
    run(python, "-m", "pip", "uninstall", "--quiet", "--yes", "pip", "setuptools")
    return python


def size_mb(folder: Path) -> float:
    """Return the size of all files that pip has installed, without compiled Python."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.suffix != ".pyc")
    return sum(path.stat().st_size for path in files) / 1e6


def start_s(python: Path) -> float:
    """Return the shortest processor time of `divespot --version`."""

    def once() -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        run(python, "-m", "divespot", "--version")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return min(once() for _ in range(STARTS))


def bytes_a_point(python: Path) -> float:
    """Return the memory that a measurement takes for each point, beyond the points themselves."""
    few, many = (1024 * int(run(python, "-c", MEASURED, str(n))) for n in (POINTS // 10, POINTS))
    return (many - few) / (0.9 * POINTS)


def main(wheel: Path) -> None:
    """Print each figure beside its bound."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        numpy = environment(folder / "numpy", "numpy")
        python = environment(folder / "divespot", wheel.resolve())
        beyond = size_mb(python.parents[1]) - size_mb(numpy.parents[1])
        figures = {
            "wheel MB": (wheel.stat().st_size / 1e6, MOST_WHEEL_MB),
            "install beyond NumPy MB": (beyond, MOST_INSTALL_MB),
            "start, processor s": (start_s(python), MOST_START_S),
            "bytes a point beyond the input": (bytes_a_point(python), MOST_BYTES_A_POINT),
        }
    passed = [what for what, (value, most) in figures.items() if value > most]
    for what, (value, most) in figures.items():
        print(f"{what:32} {value:8.2f}   at most {most:g}")
    if passed:
        sys.exit(f"too much: {', '.join(passed)}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
