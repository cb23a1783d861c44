"""What the README and the pages of docs/ show must work."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from divespot.cli import main

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language: str, page: str = README) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", page, re.DOTALL)


def test_python_example_runs(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = blocks("python")
    exec(compile(example, "README.md", "exec"), {})  # noqa: S102 - our own example
    said = capsys.readouterr().out
    assert re.match(r"pile 1: 0\.02[678]\d ± 0\.00\d\d m³\n", said)
    assert '"schema": "divespot.report/1"' in said


def commands() -> list[str]:
    pages = [README, *(page.read_text(encoding="utf-8") for page in (ROOT / "docs").glob("*.md"))]
    lines = "".join("".join(blocks("sh", page)) for page in pages).splitlines()
    return sorted({line for line in lines if line.startswith("divespot ")})


@pytest.mark.parametrize("line", commands())
def test_command_is_understood(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "site.toml").write_text("")  # a profile is read with the options
    _, name, *args = shlex.split(line, comments=True)
    assert isinstance(main, click.Group)
    main.commands[name].make_context(name, args)


def test_readme_is_read_in_three_minutes() -> None:
    text = re.sub(r"^\|.*$", "", README, flags=re.MULTILINE)
    assert len(text.split()) <= 600, "words outside of tables"


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target


def test_picture_is_small() -> None:
    (picture,) = re.findall(r"!\[.+\]\((.+)\)", README)
    assert 10_000 < (ROOT / picture).stat().st_size < 100_000
