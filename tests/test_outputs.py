"""Nothing is lost: outputs never take the place of inputs, and are written whole or not at all."""

from __future__ import annotations

import json
import os
import resource
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError
from divespot import io as dio
from divespot.cli import main
from divespot.output import append_line, whole
from divespot.plot import save_picture
from divespot.simulate import scan

if TYPE_CHECKING:
    from collections.abc import Callable

    from click.testing import Result

#: Options of `divespot measure` that write a file, with a name that suits.
OUTPUTS = {
    "--json": "out.json",
    "--csv": "out.csv",
    "--picture": "out.png",
    "--picture-ground": "out.pdf",
    "--las": "out.laz",
    "--save-base": "base.ply",
    "--save-outlines": "out.geojson",
}


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


def process(
    *args: str | Path,
    **options: Any,  # noqa: ANN401 - as subprocess has it
) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "divespot", *map(str, args)]
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run(  # noqa: S603 - our own command
        command, text=True, check=False, timeout=120, **options
    )


@pytest.fixture
def heap(tmp_path: Path) -> Path:
    path = tmp_path / "heap.ply"
    dio.write(path, SCAN)
    return path


SCAN = scan("shape-05", density=0.02).points
SCAN = SCAN[np.isfinite(SCAN).all(axis=1)]


@pytest.mark.parametrize("option", OUTPUTS)
@pytest.mark.parametrize("force", [[], ["--force"]])
def test_an_output_never_takes_the_place_of_an_input(
    option: str, force: list[str], tmp_path: Path, heap: Path
) -> None:
    scan_path = heap.rename(tmp_path / OUTPUTS[option])
    before = scan_path.read_bytes()
    link = tmp_path / f"link-{OUTPUTS[option]}"
    link.symlink_to(scan_path)
    for target in (scan_path, link, f"{tmp_path}/../{tmp_path.name}/{scan_path.name}"):
        result = run("measure", scan_path, option, target, *force)
        assert result.exit_code == 1
        assert "would overwrite an input" in result.stderr
    assert scan_path.read_bytes() == before


@pytest.mark.parametrize("option", OUTPUTS)
def test_what_is_not_our_own_is_overwritten_by_force_alone(
    option: str, tmp_path: Path, heap: Path
) -> None:
    target = tmp_path / OUTPUTS[option]
    for precious in (b"precious", b"ply\nformat ascii 1.0\n", b'{"type": "FeatureCollection"}'):
        target.write_bytes(precious)
        refused = run("measure", heap, option, target)
        assert refused.exit_code == 1
        assert "--force" in refused.stderr
        assert target.read_bytes() == precious
    assert run("measure", heap, option, target, "--force").exit_code == 0
    assert run("measure", heap, option, target).exit_code == 0, "it is our own now"
    assert target.read_bytes() != precious


def test_bases_and_outlines_that_are_read_are_not_written(tmp_path: Path, heap: Path) -> None:
    base, lines = tmp_path / "base.ply", tmp_path / "lines.geojson"
    assert run("measure", heap, "--save-base", base, "--save-outlines", lines).exit_code == 0
    for options in (
        ("--base", f"surface={base}", "--save-base", base),
        ("--outline", lines, "--save-outlines", lines),
        ("--save-base", tmp_path / "same.ply", "--save-outlines", tmp_path / "same.ply"),
    ):
        assert "would overwrite an input" in run("measure", heap, *options).stderr


def test_a_pattern_that_names_a_scan_as_output_loses_nothing(tmp_path: Path, heap: Path) -> None:
    other = tmp_path / "other.ply"
    other.write_bytes(heap.read_bytes())
    result = run("measure", "--json", heap, other)
    assert result.exit_code == 1
    assert heap.read_bytes() == other.read_bytes()


def test_simulate_overwrites_its_own_alone(tmp_path: Path) -> None:
    path, truth = tmp_path / "x.ply", tmp_path / "t.json"
    args = ("simulate", "shape-05", "--density", "0.02", "-o", path, "--truth", truth)
    assert run(*args).exit_code == 0
    assert run(*args).exit_code == 0
    path.write_bytes(b"precious")
    assert run(*args).exit_code == 1
    assert path.read_bytes() == b"precious"
    assert run(*args, "--force").exit_code == 0
    truth.write_bytes(b"precious")
    assert run(*args).exit_code == 1


def test_functions_do_not_write_over_their_scan(heap: Path) -> None:
    report = divespot.measure(heap)
    before = heap.read_bytes()
    for save in (divespot.save_outlines, save_picture):
        with pytest.raises(DivespotError, match="would overwrite an input"):
            save(report, heap)
    assert heap.read_bytes() == before


# Whole or not at all


def test_a_write_that_fails_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o640)
    with pytest.raises(TypeError), whole(path) as stream:
        stream.write(b"half" if stream.tell() else None)  # type: ignore[arg-type]
    assert path.read_text() == "old"
    with whole(path) as stream:
        stream.write(b"new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640
    assert [item.name for item in tmp_path.iterdir()] == ["a.txt"]


def test_a_link_stays_one_and_a_device_is_written(tmp_path: Path) -> None:
    target, link = tmp_path / "a.txt", tmp_path / "b.txt"
    target.write_text("old")
    link.symlink_to(target)
    with whole(link) as stream:
        stream.write(b"new")
    assert link.is_symlink()
    assert target.read_text() == "new"
    with whole(os.devnull) as stream:
        stream.write(b"gone")
    assert not Path(os.devnull).is_file()


@pytest.mark.parametrize("path", ["none/a.txt", "a\0b", "", "n" * 3000])
def test_paths_that_cannot_be_written(path: str) -> None:
    with pytest.raises(DivespotError), whole(path) as stream:
        stream.write(b"x")
    with pytest.raises(DivespotError):
        append_line(path, "x\n")


def test_lines_are_appended_behind_half_a_line(tmp_path: Path) -> None:
    path = tmp_path / "a.jsonl"
    append_line(path, "1\n")
    path.write_text(path.read_text() + '{"cut')
    append_line(path, "2\n")
    assert path.read_text() == '1\n{"cut\n2\n'


def limited(bytes_: int) -> Callable[[], None]:
    """Return a function that limits a child's files to some bytes, like a full disk."""

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (bytes_, bytes_))

    return limit


@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files")
@pytest.mark.parametrize("option", OUTPUTS)
def test_a_full_disk_leaves_the_old_file(option: str, tmp_path: Path, heap: Path) -> None:
    target = tmp_path / OUTPUTS[option]
    assert run("measure", heap, option, target).exit_code == 0
    before = target.read_bytes()
    done = process("measure", heap, option, target, preexec_fn=limited(100))
    assert done.returncode == 1
    assert "cannot be written" in done.stderr
    assert "pile 1" in done.stdout, "the table is not lost with the file"
    assert target.read_bytes() == before
    assert not list(tmp_path.glob(".*"))


@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files")
def test_a_full_disk_leaves_whole_lines(tmp_path: Path, heap: Path) -> None:
    target = tmp_path / "out.jsonl"
    append_line(target, "{}\n")
    done = process("measure", heap, "--append", "--json", target, preexec_fn=limited(500))
    assert done.returncode == 1
    assert target.read_text() == "{}\n"


@pytest.mark.skipif(os.name == "nt", reason="no SIGKILL")
def test_killed_while_writing(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    path.write_bytes(b"old")
    code = (
        "import os, signal\n"
        "from divespot.output import whole\n"
        f"with whole({str(path)!r}) as stream:\n"
        "    stream.write(b'half'); stream.flush(); os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False)  # noqa: S603 - our own code
    assert done.returncode == -signal.SIGKILL
    assert path.read_bytes() == b"old"


def test_a_folder_that_may_not_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, heap: Path
) -> None:
    # Not by chmod: root, under whom containers run tests, may write everywhere.
    opened = Path.open

    def refuse(self: Path, mode: str = "r", *args: Any, **kwargs: Any) -> Any:  # noqa: ANN401
        if mode[0] in "wax":
            raise PermissionError(13, "Permission denied")
        return opened(self, mode, *args, **kwargs)

    monkeypatch.setattr(Path, "open", refuse)
    for option, name in OUTPUTS.items():
        result = run("measure", heap, option, tmp_path / name)
        assert result.exit_code == 1
        assert "Permission denied" in result.stderr
        assert "pile 1" in result.stdout


# What goes wrong with one output costs that one alone


def test_the_picture_comes_last_and_alone_is_lost(
    tmp_path: Path, heap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_args: object, **_options: object) -> None:
        assert (tmp_path / "out.json").exists()
        raise IndexError

    monkeypatch.setattr("divespot.plot.figure", fail)
    outputs = (option for pair in OUTPUTS.items() for option in (pair[0], tmp_path / pair[1]))
    result = run("measure", heap, *outputs)
    assert result.exit_code == 1
    assert "pile 1" in result.stdout
    assert "out.png: cannot be drawn (IndexError" in result.stderr
    assert sorted(p.name for p in tmp_path.glob("*o*")) == sorted(
        ["out.csv", "out.json", "out.geojson", "out.laz", "out.pdf"]
    )  # fmt: skip
    assert (tmp_path / "base.ply").exists()


def test_a_picture_of_an_object_without_outline(tmp_path: Path, heap: Path) -> None:
    import dataclasses  # noqa: PLC0415

    report = divespot.measure(heap)
    bare = tuple(dataclasses.replace(one, corners_m=()) for one in report.level.outlines)
    level = dataclasses.replace(report.level, outlines=bare)
    save_picture(dataclasses.replace(report, scene=level), tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 1000


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_or_closed_stderr_does_not_cost_the_report(heap: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = process("measure", heap, "--json", "-", stderr=full)
    assert json.loads(done.stdout)["piles"]
    done = process("measure", heap, "--json", "-", preexec_fn=lambda: os.close(2), stderr=None)
    assert json.loads(done.stdout)["piles"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_or_closed_stdout_does_not_cost_the_files(tmp_path: Path, heap: Path) -> None:
    targets = [(option, tmp_path / name) for option, name in OUTPUTS.items()]
    arguments = [part for pair in targets for part in pair]
    with Path("/dev/full").open("w") as full:
        done = process("measure", heap, *arguments, stdout=full)
    assert done.returncode == 1
    assert "the standard output: cannot be written" in done.stderr
    assert "Traceback" not in done.stderr
    assert all(path.exists() for _, path in targets)
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = process("measure", heap, *arguments, stdout=write_end)
    os.close(write_end)
    assert "Traceback" not in done.stderr


def test_json_for_a_closed_stdout_is_no_success(heap: Path) -> None:
    shell = f'"$0" -m divespot measure {shlex.quote(str(heap))} --json - >&-'
    done = subprocess.run(  # noqa: S603
        ["/bin/sh", "-c", shell, sys.executable], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert "the standard output is closed" in done.stderr


def test_what_is_read_is_never_written_from_python(tmp_path: Path, heap: Path) -> None:
    before = heap.read_bytes()
    report = divespot.measure(heap)
    for save in (divespot.save_base, divespot.save_outlines, save_picture):
        with pytest.raises(DivespotError, match="would overwrite an input"):
            save(report, heap)
    assert heap.read_bytes() == before
    base = tmp_path / "floor.ply"
    divespot.save_base(report, base)
    later = divespot.measure(heap, base=f"surface={base}")
    with pytest.raises(DivespotError, match="would overwrite an input"):
        divespot.save_base(later, base)


@pytest.mark.parametrize("path", ["a\0b.ply", "\ud800.ply", "n" * 5000 + ".ply"])
def test_what_is_no_path_is_refused_as_such(heap: Path, path: str) -> None:
    report = divespot.measure(heap)
    for save in (divespot.save_base, divespot.save_outlines, save_picture):
        with pytest.raises(DivespotError, match=r"is no path|cannot be written"):
            save(report, path)


# Several scans


def lines_of(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def test_every_scan_has_a_line_with_its_time(tmp_path: Path, heap: Path) -> None:
    out, bad = tmp_path / "out.jsonl", tmp_path / "bad\x1b[31m.ply"
    bad.write_bytes(b"no scan")
    result = run("measure", heap, bad, tmp_path / "none.ply", heap, "--json", out)
    assert result.exit_code == 1
    lines = lines_of(out)
    assert ["error" in line for line in lines] == [False, True, True, False]
    assert [line["source"]["path"] for line in lines[:2]] == [str(heap), str(bad)]
    assert all(line["time"].endswith("+00:00") for line in lines)
    assert {line["schema"] for line in lines} == {"divespot.report/1", "divespot.error/1"}
    assert "\x1b" not in result.stderr


def test_lines_take_the_place_of_old_ones_or_are_appended(tmp_path: Path, heap: Path) -> None:
    out = tmp_path / "out.jsonl"
    for _ in range(2):
        assert run("measure", heap, heap, "--json", out).exit_code == 0
        assert len(lines_of(out)) == 2
    for count in (3, 4):
        assert run("measure", heap, "--json", out, "--append").exit_code == 0
        assert len(lines_of(out)) == count
    assert run("measure", heap, "--append").exit_code == 2
