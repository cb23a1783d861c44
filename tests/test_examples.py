"""Examples in docstrings run, and every public function has one."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re
import runpy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import divespot
from divespot import frames, io, plot, simulate, volume

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


SCRIPTS = sorted((PACKAGE.parents[1] / "examples").glob("*.py"))

#: What each script prints, as far as it is to be.
PRINTED = {
    "camera_over_a_bay": r'(\{"mass_kg": (19|20|21)\.\d+,.*\}\n){2}\{"error": "the array: .*"\}',
    "kernels": r"[\d,]+ points, 0\.02\d+ m3 above the cut, truth 0\.028",
    "paper_and_instrument": r"instrument +[+-][01]\.\d+ %\n(\w.* [+-]\d+\.\d\d %\n?){6}",
    "survey_of_a_yard": r"(\d  .* m3 ± \d\.\d %\n +\{.*\}\n)+inside .* \d+\.\d m3",
    "what_was_taken_away": r"-0\.03[45]\d ± 0\.000\d m3",
}


@pytest.mark.skipif(not SCRIPTS, reason="the examples are not beside the package")
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_scripts_run(
    script: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("scipy")
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(script), run_name="__main__")
    assert re.fullmatch(PRINTED[script.stem], capsys.readouterr().out.strip())


#: Public functions that need no example: what is drawn on is in the example beside it.
WITHOUT = {"figure"}


def functions(module: ModuleType) -> dict[str, Any]:
    names = getattr(module, "__all__", ("figure", "save_picture"))
    found = {name: getattr(module, name) for name in names}
    return {name: each for name, each in found.items() if inspect.isfunction(each)}


@pytest.mark.parametrize("module", [divespot, frames, io, plot, simulate, volume])
def test_every_public_function_has_an_example(module: ModuleType) -> None:
    for name, function in functions(module).items():
        assert name in WITHOUT or ">>> " in (function.__doc__ or ""), name
