"""Options from a file."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

from divespot.cli import main
from test_differences import yard

if TYPE_CHECKING:
    from pathlib import Path

HEAPS = (((-1.0, 0.0), 0.9, 0.5), ((1.2, 0.0), 0.6, 0.4))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("profile")
    np.save(found / "scan.npy", yard(1, *HEAPS))
    np.save(found / "floor.npy", yard(2))
    return found


def run(*args: str | Path) -> tuple[int, str, str]:
    done = CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")
    return done.exit_code, done.stdout, done.stderr


def measured(*args: str | Path) -> dict[str, Any]:
    status, out, said = run("measure", *args, "--json", "-")
    assert status == 0, said
    report: dict[str, Any] = json.loads(out)
    return report


def test_a_profile_says_what_the_command_line_would(folder: Path) -> None:
    (folder / "a.toml").write_text(
        'material = "corn"\nup = "z"\nseed = 3\ncell_m = 0.05\nlevel = false\n'
        "crop = [-3.0, -3.0, -1.0, 0.2, 3.0, 2.0]\ncompare-bases = true\n"
    )
    words = "--material corn --up z --seed 3 --cell 0.05 --no-level --compare-bases"
    expected = measured(folder / "scan.npy", *words.split(), "--crop", "-3,-3,-1,0.2,3,2")
    found = measured(folder / "scan.npy", "--profile", folder / "a.toml")
    for report in (expected, found):
        report["timings_s"] = {}
    assert found == expected
    assert len(found["piles"]) == 1
    other = measured(folder / "scan.npy", "--profile", folder / "a.toml", "--material", "wheat")
    assert other["settings"]["material"] == "wheat"


def test_files_lie_beside_the_profile_that_names_them(folder: Path) -> None:
    (folder / "site.toml").write_text(
        'site = "Yard 3"\nbase = "surface=floor.npy"\nhistory = "yard.db"\ncsv = "log.csv"\n'
        'append = true\nshow-unit = "L"\n'
    )
    for _ in range(2):
        status, table, said = run(
            "measure", folder / "scan.npy", "--profile", folder / "site.toml", "--json",
            folder / "last.json",
        )  # fmt: skip
        assert status == 0, said
        assert "net volume L" in table
    assert len((folder / "log.csv").read_text().splitlines()) == 5
    status, table, _ = run("history", folder / "yard.db", "--site", "Yard 3")
    assert (status, "2 measurements" in table) == (0, True)
    report = json.loads((folder / "last.json").read_text().splitlines()[-1])
    assert report["settings"]["base"] == f"surface={folder / 'floor.npy'}"


def test_what_another_command_takes_is_passed_over(folder: Path) -> None:
    (folder / "b.toml").write_text('site = "Yard"\nhistory = "b.db"\nshow_unit = "L"\n')
    status, table, said = run(
        "compare", folder / "floor.npy", folder / "scan.npy", "--profile", folder / "b.toml"
    )
    assert status == 0, said
    assert "net L" in table
    assert not (folder / "b.db").exists()


@pytest.mark.parametrize(
    ("content", "needed"),
    [
        ('matrial = "corn"', "matrial is no option: the name of one, such as material, is needed"),
        ("seed = 1.5.2", "TOML is needed"),
        ("\x00\xff", "TOML is needed"),
        ("[crop]\nx = 1", "crop is a dict: a text, a number or true is needed"),
        ("crop = [[1, 2], {x = 1}]", "crop is a dict"),
        ("cell_m = -1", "cell_m is -1"),
        ('cell_m = "wide"', "'wide': a number of metres, or auto, is needed"),
        ("material = 2026-11-26", "material is a date"),
        ("force = true", "force is no option"),
    ],
)  # fmt: skip
def test_a_bad_profile_is_wrong_usage(content: str, needed: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content.encode("latin-1"))
    status, out, said = run("measure", "scan.ply", "--profile", path)
    assert (status, out) == (2, "")
    assert needed in said
    assert run("measure", "scan.ply", "--profile", tmp_path / "none.toml")[0] == 2


def test_no_output_takes_the_place_of_a_profile(folder: Path) -> None:
    path = folder / "kept.toml"
    path.write_text('json = "kept.toml"\n')
    status, _, said = run("measure", folder / "scan.npy", "--profile", path, "--force")
    assert status == 1
    assert "would overwrite an input" in said
    assert path.read_text() == 'json = "kept.toml"\n'
