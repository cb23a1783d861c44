"""Examples in docstrings run, and every public function has one."""

from __future__ import annotations

import doctest
import importlib
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import divespot
from divespot import io, plot, simulate, volume

if TYPE_CHECKING:
    from types import ModuleType

PACKAGE = Path(divespot.__file__).parent
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def with_examples() -> list[str]:
    found = (path for path in PACKAGE.rglob("*.py") if ">>> " in path.read_text())
    names = (".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in found)
    return sorted(name.removesuffix(".__init__") for name in names)


@pytest.mark.parametrize("name", with_examples())
def test_examples_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name.startswith("divespot.volume"):
        pytest.importorskip("scipy")
    if name == "divespot.plot":
        pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name)
    failed, tried = doctest.testmod(module, optionflags=FLAGS)
    assert (failed, tried > 0) == (0, True)


#: Public functions that need no example: what is drawn on is in the example beside it.
WITHOUT = {"figure", "scene_named"}


def functions(module: ModuleType) -> dict[str, Any]:
    names = getattr(module, "__all__", ("figure", "save_picture"))
    found = {name: getattr(module, name) for name in names}
    return {name: each for name, each in found.items() if inspect.isfunction(each)}


@pytest.mark.parametrize("module", [divespot, io, plot, simulate, volume])
def test_every_public_function_has_an_example(module: ModuleType) -> None:
    for name, function in functions(module).items():
        assert name in WITHOUT or ">>> " in (function.__doc__ or ""), name
