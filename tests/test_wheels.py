"""A board needs no compiler: all that divespot needs has a wheel for aarch64 on every Python."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterable

PYPROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"
PYTHONS = ("3.10", "3.11", "3.12", "3.13", "3.14")
# What pip of an aarch64 board with glibc 2.28 or newer takes.
PLATFORMS = ("manylinux2014_aarch64", "manylinux_2_17_aarch64", "manylinux_2_28_aarch64")

#: Extras of which something is built from source on aarch64; `docs/edge.md` says so.
COMPILED = {"hdbscan"}


def project() -> dict[str, Any]:
    tomllib = pytest.importorskip("tomllib", reason="TOML is read from Python 3.11 on")
    found: dict[str, Any] = tomllib.loads(PYPROJECT.read_text("utf-8"))["project"]
    return found


def resolving(python: str, needs: Iterable[str]) -> subprocess.Popen[str]:
    """Start a pip that looks for wheels and installs none."""
    command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed"]
    command += ["--quiet", "--disable-pip-version-check", "--target=none", "--retries=0"]
    command += ["--only-binary=:all:", f"--python-version={python}"]
    command += [f"--platform={platform}" for platform in PLATFORMS]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen([*command, *needs], text=True, **pipes)  # type: ignore[call-overload,no-any-return]  # noqa: S603 - pip


def said(pip: subprocess.Popen[str]) -> str:
    """Return why pip failed; nothing where it did not."""
    _, errors = pip.communicate(timeout=300)
    return errors if pip.returncode else ""


@pytest.fixture(scope="module", autouse=True)
def _network() -> None:
    if error := said(resolving("3.12", ["click"])):
        pytest.skip(f"no package can be looked up here: {error.splitlines()[-1]}")


def test_all_but_the_named_extras_have_wheels() -> None:
    needs = project()["dependencies"]
    for name, more in project()["optional-dependencies"].items():
        needs += [] if name in COMPILED else more
    looks = {python: resolving(python, sorted({*needs})) for python in PYTHONS}
    assert {python: said(pip) for python, pip in looks.items()} == dict.fromkeys(PYTHONS, "")


def test_the_named_extras_have_none() -> None:
    extras = project()["optional-dependencies"]
    looks = [resolving(python, extras[name]) for name in COMPILED for python in PYTHONS]
    assert all("No matching distribution" in said(pip) for pip in looks)
