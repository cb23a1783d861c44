"""The aarch64 wheel, tested where there is no such machine: Debian's Python for arm64 under qemu.

Unpacks an arm64 Python and the wheels of all that divespot and its tests need into a folder, runs
a part of the tests there, and compares what each stage of a measurement hands on with this machine,
bit for bit. Nothing is installed into the system: apt is given folders of its own.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "target" / "aarch64"
SYSTEM, SITE, APT, SCENES = (FOLDER / name for name in ("system", "site", "apt", "scenes"))

#: The Jetson Nano's core, and the Raspberry Pi 5's: the nearest that qemu 7.2 has to Orin's, a
#: Cortex-A78.
CORES = ("cortex-a57", "cortex-a76")

PLATFORMS = ("manylinux2014_aarch64", "manylinux_2_17_aarch64", "manylinux_2_28_aarch64")
DEBIAN = ("python3", "libstdc++6")
NEEDED = ("qemu-aarch64-static", "apt-get", "dpkg-deb")

#: What is run of the tests: what must be the same everywhere, kernels, what reads and writes.
TESTS = ("pinned", "lzf", "voxel", "neighbors", "histogram", "plane", "grid", "spacing", "status")

#: Points of a compared scan, relative to the scene's own: qemu is 14 to 40 times slower.
DENSITY = 0.03


def run(*command: str | Path) -> str:
    """Run a program and return what it prints; where it fails, say so and end."""
    done = subprocess.run(command, check=False, text=True, stdout=subprocess.PIPE)
    if done.returncode != 0:
        print(done.stdout)
        sys.exit(f"{Path(command[0]).name} failed with exit status {done.returncode}")
    return str(done.stdout)


def require_tools() -> None:
    """End where a tool is missing."""
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        sys.exit(f"not here: {', '.join(missing)} (Debian: apt-get install qemu-user-static)")


def unpack_system() -> None:
    """Unpack Debian's arm64 Python."""
    if SYSTEM.is_dir():
        return
    state, cache = APT / "state", APT / "cache"
    for folder in (state / "lists" / "partial", cache / "archives" / "partial"):
        folder.mkdir(parents=True, exist_ok=True)
    (state / "status").touch()
    places = {"State": state, "State::status": state / "status", "Cache": cache}
    options = [f"-oDir::{name}={path}" for name, path in places.items()]
    options += ["-oAPT::Architecture=arm64", "-oAPT::Architectures=arm64", "-qq"]
    run("apt-get", *options, "update")
    wanted = ("install", "--yes", "--download-only", "--no-install-recommends")
    run("apt-get", *options, *wanted, *DEBIAN)
    for package in (cache / "archives").glob("*.deb"):
        run("dpkg-deb", "--extract", package, SYSTEM)


def fill_site(wheel: Path) -> None:
    """Install what divespot and its tests need, and the wheel, by wheels alone."""
    version = (SYSTEM / "usr" / "bin" / "python3").readlink().name.removeprefix("python")
    platforms = [f"--platform={platform}" for platform in PLATFORMS]
    where = [f"--target={SITE}", f"--python-version={version}", "--only-binary=:all:"]
    if not SITE.is_dir():
        pip = (sys.executable, "-m", "pip", "install", "--quiet", *where, *platforms)
        run(*pip, f"{wheel}", "pytest>=8", "hypothesis>=6.100")
    shutil.rmtree(SITE / "divespot")
    with ZipFile(wheel) as packed:
        packed.extractall(SITE)


def emulated(core: str, *command: str | Path) -> str:
    """Run the arm64 Python on a core."""
    path = f"{SITE}:{ROOT / 'tests'}"
    settings = ("-E", f"PYTHONPATH={path}", "-E", "PYTHONDONTWRITEBYTECODE=1")
    python = SYSTEM / "usr" / "bin" / "python3"
    return run("qemu-aarch64-static", "-cpu", core, "-L", SYSTEM, *settings, python, *command)


def draw_scenes() -> list[Path]:
    """Write a scan of each scene, and what is given with it: machines may simulate otherwise."""
    import numpy as np  # noqa: PLC0415 - as is installed

    from divespot import simulate  # noqa: PLC0415
    from divespot.evaluate.given import given_with  # noqa: PLC0415

    SCENES.mkdir(exist_ok=True)
    paths = [SCENES / f"{name}.npy" for name in simulate.NAMES]
    for path in paths:
        taken = simulate.scan(path.stem, density=DENSITY)
        np.save(path, taken.points)
        path.with_suffix(".json").write_text(json.dumps(given_with(taken)))
    return paths


def compare(expected: str, found: str, core: str) -> int:
    """Print the first stage of each scene that differs; return how many scenes differ."""
    ours, theirs = (text.splitlines() for text in (expected, found))
    different: dict[str, str] = {}
    for line, other in zip(ours, theirs, strict=True):
        if line != other:
            scan, stage, _ = line.split("\t")
            different.setdefault(scan, stage)
    for scan, stage in different.items():
        print(f"{core}: {scan}: the stage {stage!r} differs from this machine's")
    scans = len({line.split("\t")[0] for line in ours})
    print(f"{core}: {len(ours)} results of {scans} scenes, {scans - len(different)} bit-identical")
    return len(different)


def main(wheel: Path) -> None:
    """Test and compare."""
    require_tools()
    FOLDER.mkdir(parents=True, exist_ok=True)
    unpack_system()
    fill_site(wheel.resolve())
    scenes = draw_scenes()
    expected = run(sys.executable, ROOT / "packaging" / "stages.py", *scenes)
    different = 0
    for core in CORES:
        found = emulated(core, ROOT / "packaging" / "stages.py", *scenes)
        different += compare(expected, found, core)
    tests = [ROOT / "tests" / f"test_{name}.py" for name in TESTS]
    print(emulated(CORES[0], "-m", "pytest", "--hypothesis-profile=ci", *tests))
    if different:
        sys.exit(f"{different} scenes differ")


if __name__ == "__main__":
    os.chdir(ROOT)
    main(Path(sys.argv[1]))
