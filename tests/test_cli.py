"""The command line: its JSON, its exit status, and that bad input gives one line."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import Settings
from divespot import io as dio
from divespot.cli import main
from divespot.cli.options import FIELDS, GROUPS, OTHERS, STAGES
from divespot.simulate import NAMES, scan

if TYPE_CHECKING:
    from click.testing import Result

#: A scan's format for settings that mean something to one alone.
FORMATS = {"columns": ".xyz", "classes": ".las", "returns": ".las"}

OUTLINE = Path(__file__).parent / "data" / "heap.geojson"
"""A square around the only pile of shape-05."""

#: A value other than the default for each setting, as typed and as passed to Python.
OTHER_VALUES: dict[str, tuple[list[str], Any]] = {
    "unit": (["--unit", "mm"], "mm"),
    "crs": (["--crs", "EPSG:32632"], "EPSG:32632"),
    "columns": (["--columns", "2,1,3"], "2,1,3"),
    "classes": (["--classes", "0,2"], "0,2"),
    "returns": (["--returns", "last"], "last"),
    "crop": (["--crop", "-9,-9,-9,9,9,9.5"], (-9.0, -9.0, -9.0, 9.0, 9.0, 9.5)),
    "up": (["--up", "-z"], "-z"),
    "max_tilt_deg": (["--max-tilt-deg", "30"], 30.0),
    "radius_m": (["--radius-m", "0.07"], 0.07),
    "min_neighbors": (["--min-neighbors", "3"], 3),
    "scene_cluster": (["--no-scene-cluster"], False),
    "voxel_m": (["--voxel-m", "0.03"], 0.03),
    "level": (["--no-level"], False),
    "plane_threshold_m": (["--plane-threshold-m", "0.02"], 0.02),
    "hypotheses": (["--hypotheses", "321"], 321),
    "cell_m": (["--cell-m", "0.05"], 0.05),
    "bin_m": (["--bin-m", "0.004"], 0.004),
    "window": (["--window", "3"], 3),
    "lower_fraction": (["--lower-fraction", "0.4"], 0.4),
    "ground_form": (["--ground-form", "surface"], "surface"),
    "margin_m": (["--margin-m", "0.02"], 0.02),
    "fine_cluster": (["--no-fine-cluster"], False),
    "fine_radius_m": (["--fine-radius-m", "0"], 0.0),
    "cluster_backend": (["--cluster-backend", "hdbscan"], "hdbscan"),
    "min_cluster_size": (["--min-cluster-size", "17"], 17),
    "min_samples": (["--min-samples", "4"], 4),
    "link_m": (["--link-m", "0.1"], 0.1),
    "surface": (["--surface", "triangles"], "triangles"),
    "select": (["--select", "all"], "all"),
    "outline": (["--outline", str(OUTLINE)], str(OUTLINE)),
    "inside": (["--inside", "-9,-9,9,9"], (-9.0, -9.0, 9.0, 9.0)),
    "base": (["--base", "height=0.01"], "height=0.01"),
    "compare_bases": (["--compare-bases"], True),
    "repeat": (["--repeat"], True),
    "toe_m": (["--toe-m", "0.08"], 0.08),
    "annulus_share": (["--annulus-share", "0.2"], 0.2),
    "factor": (["--factor", "1.1"], 1.1),
    "density_kg_m3": (["--density-kg-m3", "721"], 721.0),
    "density_u_kg_m3": (["--density-u", "20"], 20.0),
    "material": (["--material", "oats"], "oats"),
    "seed": (["--seed", "7"], 7),
    "threads": (["--threads", "1"], 1),
}


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


def process(
    *args: str | Path, env: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run the real command."""
    command = [sys.executable, "-m", "divespot", *map(str, args)]
    return subprocess.run(  # noqa: S603 - our own command
        command, capture_output=True, text=True, check=False, timeout=120, env=env
    )


def one_line(result: Result) -> str:
    """Return the one line of a failure; it must be all there is."""
    assert result.exit_code == 1, result.output
    assert result.stdout == ""
    assert result.exception is None or isinstance(result.exception, SystemExit)
    assert re.fullmatch(r"divespot: [^\n]+\n", result.stderr), result.stderr
    return result.stderr


def without_times(report: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in report.items() if name != "timings_s"}


@pytest.fixture(scope="module")
def heap(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the path of a small scan of one pile of 0.028 m3."""
    path = tmp_path_factory.mktemp("heap") / "heap.npy"
    np.save(path, scan("shape-05", density=0.03).points)
    return path


def test_json_keeps_its_contract(heap: Path) -> None:
    result = run("measure", heap, "--json", "-")
    assert result.exit_code == 0
    report = json.loads(result.stdout)
    kinds = {
        "schema": str,
        "divespot": str,
        "status": str,
        "source": dict,
        "piles": list,
        "other_objects": list,
        "total": dict,
        "ground": dict,
        "settings": dict,
        "seed": int,
        "timings_s": dict,
        "warnings": list,
    }
    assert {name: type(value) for name, value in report.items()} == kinds
    assert report["schema"] == "divespot.report/1"
    assert set(report["settings"]) == {*FIELDS, "stages"}
    assert set(report["settings"]["stages"]) == set(STAGES)
    for name in ("radius_m", "cell_m", "margin_m"):
        assert report["settings"][name] > 0, "derived lengths are told"
    assert report["settings"]["stages"]["toe_m"] > 0
    source = ("path", "points", "dropped_nonfinite", "dropped_zero", "unit", "crs")
    assert tuple(report["source"]) == (*source, "files", "scale_factor")
    assert set(report["total"]) == {"volume_m3", "u95_m3", "mass_kg", "u95_mass_kg"}
    ground = {"normal", "offset_m", "tilt_deg", "roughness_m", "inlier_fraction", "up_from"}
    assert set(report["ground"]) == ground
    (pile,) = report["piles"]
    numbers = ("volume_m3", "u95_m3", "cut_m3", "fill_m3", "footprint_m2", "max_height_m")
    assert all(isinstance(pile[name], float) for name in (*numbers, "seen_fraction"))
    assert pile["id"] == 1
    assert isinstance(pile["touches_edge"], bool)
    assert pile["mass_kg"] is None
    assert len(pile["centroid_m"]) == 3
    assert all(len(corner) == 3 for corner in pile["outline_m"])
    assert all(isinstance(value, float) for value in pile["budget"].values())
    assert "reason" not in pile
    assert all(isinstance(item["reason"], str) for item in report["other_objects"])
    assert pile["volume_m3"] == pytest.approx(0.028, rel=0.1)


def test_json_alone_is_on_stdout_of_a_real_process(heap: Path) -> None:
    done = process("measure", heap, "--json", "-")
    assert done.returncode == 0
    assert json.loads(done.stdout)["schema"] == "divespot.report/1"
    lines = done.stderr.splitlines()
    assert all(line.startswith("divespot: ") for line in lines), "no progress line in a pipe"


def test_every_setting_is_tried() -> None:
    assert set(OTHER_VALUES) == {*FIELDS, *STAGES}
    paper = Settings.paper()
    default = {**vars(paper.stages), **vars(Settings())}
    assert all(value != default[name] for name, (_, value) in OTHER_VALUES.items())


@pytest.mark.parametrize("name", [*FIELDS, *STAGES])
def test_option_is_the_setting(name: str, heap: Path) -> None:
    options, value = OTHER_VALUES[name]
    changes: Any = {name: value}
    settings = Settings().changed(**changes) if name in FIELDS else Settings.paper(**changes)
    options = options if name in FIELDS else [*options, "--preset", "paper"]
    if name == "cluster_backend":
        pytest.importorskip("hdbscan")
    path = heap.with_suffix(FORMATS.get(name, heap.suffix))
    if not path.exists():
        points = np.load(heap)
        dio.write(path, points[np.isfinite(points).all(axis=1)])
    result = run("measure", path, "--json", "-", *options)
    expected = divespot.measure(path, settings)
    assert result.exit_code == 0
    assert without_times(json.loads(result.stdout)) == without_times(json.loads(expected.to_json()))


def test_help_tells_of_every_setting() -> None:
    text = " ".join(run("measure", "--help").stdout.split())
    for name, item in (FIELDS | STAGES).items():
        assert f"--{name.replace('_', '-')}" in text
        # Long words may be broken at a hyphen by the line's end.
        assert item.metadata["help"].replace(" ", "")[:20] in text.replace(" ", "")


def test_help_is_in_groups_outputs_first() -> None:
    text = run("measure", "--help").stdout
    titles = ["Outputs", *OTHERS, *GROUPS]
    assert re.findall(r"^(\S.*):$", text, re.MULTILINE) == titles
    assert text.index("--json") < text.index("--picture") < text.index("--unit")
    assert sum(len(names) for names in GROUPS.values()) == len(FIELDS) + len(STAGES) + 1


def test_help_lists_what_unit_and_up_take() -> None:
    text = re.sub(r"\s+", "", run("measure", "--help").stdout)
    assert "--unit[auto|m|dm|cm|mm|km|in|ft|us-ft|yd]" in text
    assert "--upauto|x|y|z|-x|-y|-z|A,B,C" in text


def test_an_option_of_the_paper_needs_its_preset(heap: Path) -> None:
    result = run("measure", heap, "--window", "3")
    assert result.exit_code == 2
    assert "--window is of the paper's method: --preset paper is needed" in result.stderr


def test_an_option_that_is_gone_says_where_it_went(heap: Path) -> None:
    for option in ("--method", "--alpha", "--slice-m"):
        result = run("measure", heap, option, "hull")
        assert result.exit_code == 2
        assert "divespot.volume.volumes_m3 is needed" in result.stderr
    assert "No such option" in run("measure", heap, "--methods", "hull").stderr


def test_paper_preset(heap: Path) -> None:
    result = run("measure", heap, "--preset", "paper", "--json", "-", "--no-scene-cluster")
    expected = divespot.measure(heap, Settings.paper(scene_cluster=False))
    assert without_times(json.loads(result.stdout)) == without_times(json.loads(expected.to_json()))


def test_table_for_people(heap: Path) -> None:
    result = run("measure", heap, "--density-kg-m3", "721")
    assert result.exit_code == 0
    assert re.search(r"pile 1 +0\.02\d+ ± 0\.\d+ ", result.stdout)
    assert "mass kg" in result.stdout
    assert "does not state its unit" in result.stderr


def test_units_of_options_may_be_left_out(heap: Path) -> None:
    short = run("measure", heap, "--json", "-", "--density", "721", "--density-u", "30")
    long = run("measure", heap, "--json", "-", "--density-kg-m3", "721", "--density-u-kg-m3", "30")
    assert without_times(json.loads(short.stdout)) == without_times(json.loads(long.stdout))


def test_bases_are_shown_side_by_side(heap: Path) -> None:
    result = run("measure", heap, "--compare-bases", "--base", "height=0")
    assert result.exit_code == 0
    (header,) = (line for line in result.stdout.splitlines() if "by base" in line)
    assert header.split()[-5:] == ["local", "plane", "peak", "midpeak", "height=0"]


def test_an_outline_has_a_name_and_a_mass(heap: Path) -> None:
    result = run("measure", heap, "--outline", OUTLINE, "--material", "corn")
    assert re.search(r"pile 1 \(bay 4\) +0\.02\d+ ± 0\.0\d+ .* \d+\.?\d* ± \d", result.stdout)


def test_a_base_and_outlines_are_saved_and_read_again(heap: Path, tmp_path: Path) -> None:
    base, lines = tmp_path / "base.ply", tmp_path / "lines.geojson"
    saved = run("measure", heap, "--json", "-", "--save-base", base, "--save-outlines", lines)
    assert saved.exit_code == 0, saved.stderr
    (pile,) = json.loads(saved.stdout)["piles"]
    # So coarse a scan has a tenth of its volume in the toe, beyond the outline.
    for options, within in (["--base", f"surface={base}"], 1e-3), (["--outline", lines], 0.1):
        again = json.loads(run("measure", heap, "--json", "-", *options).stdout)["piles"]
        assert again[0]["volume_m3"] == pytest.approx(pile["volume_m3"], rel=within)
    assert run("measure", heap, heap, "--save-base", base).exit_code == 2


def test_materials_are_listed() -> None:
    listed = run("materials")
    assert listed.exit_code == 0
    assert re.search(r"^corn +721 +674-768 +27 +23$", listed.stdout, re.MULTILINE)
    assert "sources: " in listed.stdout


def test_no_pile_is_no_failure(tmp_path: Path) -> None:
    x, y = np.meshgrid(np.arange(60) * 0.01, np.arange(60) * 0.01)
    z = np.random.default_rng(0).normal(0.0, 0.0005, x.shape)
    np.save(tmp_path / "floor.npy", np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    result = run("measure", tmp_path / "floor.npy")
    assert result.exit_code == 0
    assert "no pile was found" in result.stderr


def test_json_into_a_file_leaves_the_table(heap: Path, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    result = run("measure", heap, "--json", path)
    assert "pile 1" in result.stdout
    assert json.loads(path.read_text(encoding="utf-8"))["piles"]


def test_several_scans_are_json_lines_and_a_bad_one_is_passed_over(heap: Path) -> None:
    result = run("measure", heap, heap.parent / "none.ply", heap, "--json", "-")
    assert result.exit_code == 1
    first, bad, last = (json.loads(line) for line in result.stdout.splitlines())
    assert first["source"]["path"] == last["source"]["path"] == str(heap)
    assert "cannot be read" in bad["error"]
    assert f"{heap.parent / 'none.ply'}: cannot be read" in result.stderr


def bad_files(folder: Path) -> dict[str, Path]:
    ply = b"ply\nformat ascii 1.0\nelement vertex 9\n"
    contents = {
        "empty.ply": b"",
        "truncated.ply": ply,
        "noise.laz": bytes(range(256)) * 9,
        "picture.npy": b"\x89PNG\r\n",
        "scan.docx": b"PK no zip",
        "three.xyz": b"0 0 1\n0 1 1\n1 0 1\n",
        "same.xyz": b"1 2 3\n" * 50,
        "nan.csv": b"nan,nan,nan\n" * 50,
        "zeros.xyz": b"0 0 0\n" * 50,
    }
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    return {name: folder / name for name in contents}


def test_bad_files_give_one_line(tmp_path: Path) -> None:
    cases = {**bad_files(tmp_path), "missing": tmp_path / "no.ply", "folder": tmp_path}
    for path in cases.values():
        assert str(path) in one_line(run("measure", path, "--json", "-"))


def test_bad_file_in_a_real_process(tmp_path: Path) -> None:
    done = process("measure", tmp_path / "no\npile.ply")
    assert (done.returncode, done.stdout) == (1, "")
    assert re.fullmatch(r"divespot: [^\n]+\n", done.stderr)


@pytest.mark.parametrize(
    "args",
    [
        ["measure"],
        ["measure", "x.ply", "--nope"],
        ["measure", "x.ply", "--radius-m", "-1"],
        ["measure", "x.ply", "--radius-m", "wide"],
        ["measure", "x.ply", "--crop", "1,2,3"],
        ["measure", "x.ply", "--crop", "a"],
        ["measure", "x.ply", "--inside", "1,2,3"],
        ["measure", "x.ply", "--inside", "1,2,0,3"],
        ["measure", "x.ply", "--inside", "1,2,3,4", "--outline", "a.geojson"],
        ["measure", "x.ply", "--base", "sea"],
        ["measure", "x.ply", "--up", "sideways"],
        ["measure", "x.ply", "--up", "0,0,0"],
        ["measure", "x.ply", "--unit", "furlong"],
        ["measure", "x.ply", "--columns", "1,2"],
        ["measure", "x.ply", "--method", "hull"],
        ["measure", "x.ply", "--base", "height=low"],
        ["measure", "x.ply", "--material", "gold"],
        ["measure", "x.ply", "--preset", "mine"],
        ["measure", "x.ply", "--picture", "x.gif"],
        ["measure", "x.ply", "y.ply", "--picture", "x.png"],
        ["simulate", "shape-01"],
        ["weigh"],
    ],
)
def test_wrong_usage(args: list[str]) -> None:
    result = run(*args)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "Traceback" not in result.stderr


def test_outputs_that_cannot_be_written(heap: Path, tmp_path: Path) -> None:
    nowhere = tmp_path / "none" / "x"
    for option, name in (("--json", "x.json"), ("--picture", "x.png")):
        result = run("measure", heap, option, nowhere.with_name(name))
        assert result.exit_code == 1
        last = result.stderr.splitlines()[-1]
        assert last.startswith("divespot: ")
        assert name in last


def test_picture_of_a_scan(heap: Path, tmp_path: Path) -> None:
    path = tmp_path / "heap.png"
    assert run("measure", heap, "--picture", path, "--json", "-").exit_code == 0
    assert_drawn(path)


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_pictures_by_their_ending(ending: str, heap: Path, tmp_path: Path) -> None:
    plan, ground = tmp_path / f"a.{ending}", tmp_path / f"b.{ending}"
    for _ in range(2 if ending == "png" else 1):  # the second time over its own
        options = ("--picture", plan, "--picture-ground", ground)
        assert run("measure", heap, *options, "-q").exit_code == 0
    for path in (plan, ground):
        begins = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[ending]
        assert path.read_bytes().startswith(begins)


def assert_drawn(path: Path) -> None:
    """Check that a PNG shows a map: many colours, little of one alone."""
    from matplotlib.image import imread  # noqa: PLC0415 - an extra

    pixels = (imread(path)[:, :, :3] * 255).astype(np.uint32) @ (1 << 16, 1 << 8, 1)
    _, counts = np.unique(pixels, return_counts=True)
    assert pixels.shape[0] > 300
    assert len(counts) > 200
    assert counts.max() < 0.9 * pixels.size


def test_picture_without_matplotlib(
    heap: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = run("measure", heap, "--picture", tmp_path / "x.png")
    assert result.exit_code == 1
    assert "pip install divespot[plot]" in result.stderr.splitlines()[-1]


@pytest.mark.parametrize("suffix", [".ply", ".npy", ".xyz", ".laz"])
def test_simulated_scan_is_measured(suffix: str, tmp_path: Path) -> None:
    path, truth = tmp_path / f"scan{suffix}", tmp_path / "truth.json"
    made = run("simulate", "shape-05", "-o", path, "--truth", truth, "--density", "0.03")
    assert made.exit_code == 0
    known = json.loads(truth.read_text(encoding="utf-8"))
    assert known["schema"] == "divespot.truth/1"
    assert (known["name"], known["seed"]) == ("shape-05", 0)
    assert np.shape(known["pose"]) == (4, 4)
    report = json.loads(run("measure", path, "--json", "-").stdout)
    assert report["source"]["points"] == known["points"]
    assert report["total"]["volume_m3"] == pytest.approx(known["volume_m3"], rel=0.1)


def test_simulated_truth_alone_is_on_stdout(tmp_path: Path) -> None:
    args = ("-o", tmp_path / "scan.ply", "--truth", "-", "--density", "0.01", "--seed", "3")
    truth = json.loads(run("simulate", "three-piles", *args).stdout)
    assert truth["seed"] == 3
    assert truth["volumes_m3"] == pytest.approx([0.035, 0.014, 0.022])


def test_simulate_lists_and_refuses(tmp_path: Path) -> None:
    listed = run("simulate", "--list").stdout.splitlines()
    assert [line.split()[0] for line in listed] == list(NAMES)
    assert "shape-01" in one_line(run("simulate", "shape-99", "-o", tmp_path / "x.ply"))
    bad = ("simulate", "shape-01", "--density", "0.01", "-o")
    assert "is needed as the ending" in one_line(run(*bad, tmp_path / "x.stl"))
    assert "density" in one_line(run("simulate", "shape-01", "-o", "x.ply", "--density", "0"))


def test_demo_compares_and_draws(tmp_path: Path) -> None:
    out = tmp_path / "of the" / "demo"
    result = run("demo", "--out", out, "--shape", "shape-05", "--density", "0.03")
    assert result.exit_code == 0, result.output
    assert re.search(r"volume m³ +0\.0280* +0\.0\d+ ± 0\.0\d+ +[+-]\d+\.\d+%", result.stdout)
    for stage in ("read", "radius filter", "pose", "volume", "all stages", "points per second"):
        assert re.search(rf"^{stage} +[\d,.]+", result.stdout, re.MULTILINE), stage
    assert_drawn(out / "shape-05.png")


def test_demo_without_matplotlib(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules["divespot.cli.demo"], "find_spec", lambda _name: None)
    result = run("demo", "--out", tmp_path, "--shape", "shape-05", "--density", "0.03")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-1].startswith("no picture: it needs matplotlib")
    assert [path.name for path in tmp_path.iterdir()] == ["shape-05.ply"]


def test_demo_without_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "folder" in one_line(run("demo", "--out", tmp_path / "file"))


def test_version_and_light_start() -> None:
    assert run("--version").stdout == f"divespot {divespot.__version__}\n"
    heavy = "matplotlib", "laspy", "divespot.simulate", "divespot.cli.table"
    code = (
        "import sys; from divespot.cli import main\n"
        "try: main(['--help'])\n"
        f"finally: print([name for name in {heavy} if name in sys.modules])"
    )
    done = subprocess.run(  # noqa: S603 - our own code
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == "[]", "--help needs to be quick"


def test_reader_that_leaves_is_no_error(heap: Path) -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    command = [sys.executable, "-m", "divespot", "measure", str(heap), "--json", "-"]
    done = subprocess.run(  # noqa: S603 - our own command
        command, stdout=write_end, stderr=subprocess.PIPE, text=True, check=False, timeout=60
    )
    os.close(write_end)
    assert all(line.startswith("divespot: ") for line in done.stderr.splitlines())


def test_terminal_without_our_letters(heap: Path) -> None:
    done = process("measure", heap, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert done.returncode == 0
    assert "pile 1" in done.stdout


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to send")
def test_ctrl_c_is_quiet(tmp_path: Path) -> None:
    # A shell's background jobs start with SIGINT ignored.
    code = (
        "import divespot.simulate.scan as s, divespot.cli as c, signal, time\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def slow(*a, **k):\n print('ready', flush=True)\n time.sleep(60)\n"
        "import divespot.simulate; divespot.simulate.scan = slow\n"
        f"c.main(['simulate', 'shape-01', '-o', {str(tmp_path / 'x.ply')!r}])"
    )
    with subprocess.Popen(  # noqa: S603 - our own code
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None
        assert child.stderr is not None
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.1)
        child.send_signal(signal.SIGINT)
        assert child.wait(timeout=30) == 130
        assert "Traceback" not in child.stderr.read()


def test_settings_are_documented() -> None:
    for item in dataclasses.fields(Settings):
        assert item.metadata["help"], item.name
