"""Tables of text, and what a terminal shows of work that takes long."""

from __future__ import annotations

import os
import subprocess
import sys

import click
import pytest

from divespot.cli.table import Table


def lines(table: Table, most: int = 80) -> list[str]:
    return [click.unstyle(line) for line in table.lines(most)]


def test_names_stand_left_numbers_right_and_text_left() -> None:
    table = Table(("", "volume\nm³", "remarks"), text=True)
    table.add_row("pile 1", "12.5", "thin")
    table.add_row("total", "1012.5", "")
    assert lines(table) == [
        "         volume   remarks",
        "             m³",
        "─────────────────────────",
        "pile 1     12.5   thin",
        "total    1012.5",
    ]


def test_text_is_wrapped_where_the_terminal_ends_and_numbers_never() -> None:
    table = Table(("a", "b", "remarks"), text=True)
    table.add_row("x", "1234567", "steep sides, leans on a wall")
    assert lines(table, 34)[2:] == [
        "x   1234567   steep sides, leans",
        "              on a wall",
    ]
    assert "1234567" in "".join(lines(table, 1))


def test_free_lines_stand_between_rows_alone() -> None:
    table = Table(("a", "b"))
    table.add_section()
    table.add_row("x", "1")
    table.add_section()
    table.add_section()
    table.add_row("y", "2")
    table.add_section()
    assert lines(table)[2:] == ["x   1", "", "y   2"]
    assert table.row_count == 2


def test_wide_letters_take_two_columns_and_accents_none() -> None:
    table = Table(("name", "n"))
    table.add_row("玉米", "1")
    table.add_row("e\N{COMBINING ACUTE ACCENT}te", "2")
    assert lines(table)[2:] == ["玉米   1", "e\N{COMBINING ACUTE ACCENT}te    2"]


def test_a_table_without_rows_has_its_names() -> None:
    assert lines(Table(("a", "b"))) == ["a   b", "─────"]


def test_names_are_bold_and_rows_as_wanted() -> None:
    table = Table(("a",))
    table.add_row("x", style="dim")
    assert list(table.lines(80))[::2] == ["\x1b[1ma\x1b[0m", "\x1b[2mx\x1b[0m"]


PROGRESS = """
import time
from divespot.cli import screen
screen.PATIENCE_S = 0.01
with screen.progress_line("measuring") as on_stage:
    time.sleep(0.2)
    on_stage("survey")
    time.sleep(0.05)
with screen.progress_bar("evaluating") as on_done:
    on_done(1, 4)
    on_done(4, 4)
"""


@pytest.mark.skipif(os.name == "nt", reason="no pseudo-terminal")
def test_progress_is_shown_on_a_terminal_and_nowhere_else() -> None:
    import pty  # noqa: PLC0415 - not everywhere

    command = [sys.executable, "-c", PROGRESS]
    ours, theirs = pty.openpty()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs):  # noqa: S603
        os.close(theirs)
        shown = b""
        try:
            while piece := os.read(ours, 4096):
                shown += piece
        except OSError:  # the other side is closed
            pass
    os.close(ours)
    assert b"measuring: survey" in shown
    assert b"4/4" in shown
    piped = subprocess.run(command, capture_output=True, check=True)  # noqa: S603
    assert piped.stdout == piped.stderr == b""
