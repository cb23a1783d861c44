"""Compare divespot with its rivals: seconds, ratios, peak memory, and whether the answers agree.

Makes its own virtual environment beside this file, installs the rivals and this divespot into it,
and runs `contest` there.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from contest.options import parse

HERE = Path(__file__).resolve().parent
ENVIRONMENT = HERE / ".venv-rivals"
PYTHON = ENVIRONMENT / "bin" / "python"
#: What every rival has wheels for.
PYTHONS = ("3.12", "3.11", "3.10")
#: Open3D's wheels need libusb, which not every machine has: libusb-package brings it.
RIVALS = ("hdbscan", "fast_hdbscan", "scipy", "scikit-learn", "libusb-package")


def main() -> int:
    """Set up, run, return the exit status."""
    parse()  # before minutes of installing
    if not sys.platform.startswith("linux"):
        raise SystemExit("rivals: peak memory is read from /proc: Linux is needed")
    if not PYTHON.exists():
        create()
    install()
    return run(PYTHON, "-m", "contest", *sys.argv[1:])


def create() -> None:
    """Make the environment with a Python that the rivals support."""
    running = ".".join(map(str, sys.version_info[:2]))
    named = [shutil.which(f"python{version}") for version in PYTHONS]
    pythons = [sys.executable] if running in PYTHONS else [path for path in named if path]
    # A version manager's launcher may stand for a version that is not installed.
    if not any(run(python, "-m", "venv", ENVIRONMENT) == 0 for python in pythons):
        raise SystemExit(f"rivals: this is Python {running}: one of {', '.join(PYTHONS)} is needed")


def install() -> None:
    """Install the rivals once, and this divespot as it stands now."""
    stamp = ENVIRONMENT / "rivals-installed"
    if not stamp.exists():
        pip("--upgrade", "pip", "maturin>=1.9.4,<2")
        pip(*RIVALS)
        # Where there is no wheel of the one there may be one of the other.
        if run(PYTHON, "-m", "pip", "install", "--quiet", "open3d") != 0:
            pip("open3d-cpu")
        stamp.touch()
    # Without isolation, so that an unchanged crate is not compiled again.
    pip("--no-build-isolation", str(HERE.parent))


def pip(*packages: str) -> None:
    """Install packages, or end with what pip said."""
    if run(PYTHON, "-m", "pip", "install", "--quiet", *packages) != 0:
        raise SystemExit(f"rivals: {' '.join(packages)} could not be installed")


def run(*command: str | Path) -> int:
    """Run a command that finds the environment's programs and `contest`; return its status."""
    paths = os.pathsep.join([str(PYTHON.parent), os.environ["PATH"]])
    environment = {**os.environ, "PATH": paths, "PYTHONPATH": str(HERE)}
    return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
