"""Recordings of ROS as frames: depth, intrinsics and times come back as they were written."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner, Result

from divespot import DivespotError, simulate
from divespot.cli import main
from divespot.extras import is_installed
from divespot.frames import Intrinsics, fuse
from divespot.frames.source import Frames
from recordings import PERIOD_NS, START_NS, Bag

if TYPE_CHECKING:
    from pathlib import Path

WITH_BAGS = pytest.mark.skipif(not is_installed("rosbags"), reason="rosbags is not installed")
WITH_PNG = pytest.mark.skipif(not is_installed("PIL.Image"), reason="Pillow is not installed")
K = [60.0, 0.0, 4.5, 0.0, 61.0, 3.0, 0.0, 0.0, 1.0]
DEPTH = np.random.default_rng(0).integers(0, 65_535, (3, 6, 9)).astype(np.uint16)
METRES = DEPTH.astype(np.float32) * np.float32(1e-3)
TIMES_S = [1e-9 * START_NS + 1e-9 * PERIOD_NS * number for number in range(3)]


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


def seen(frames: Frames) -> np.ndarray:
    return np.stack(list(frames))


@WITH_BAGS
@pytest.mark.parametrize(
    ("kind", "name"),
    [("bag", "r.bag"), ("mcap", "r"), ("sqlite", "r"), ("mcap", "r/r.mcap"), ("sqlite", "r/r.db3")],
)
def test_a_recording_of_ros_gives_back_what_was_recorded(
    kind: str, name: str, tmp_path: Path
) -> None:
    with Bag(tmp_path / name.partition("/")[0], kind) as bag:
        bag.images("/color/image_raw", DEPTH.view(np.uint8), "mono8")
        bag.camera("/color/camera_info", [9.0] * 9, (1, 1))
        bag.camera("/depth/camera_info", K, (9, 6), d=[0.1, 0.2, 0.3, 0.4, 0.5])
        bag.images("/depth/image_raw", DEPTH, "16UC1")
    frames = Frames.of(tmp_path / name)
    assert np.array_equal(seen(frames), METRES)
    assert frames.times_s == pytest.approx(TIMES_S, abs=1e-6)
    assert frames.intrinsics == Intrinsics(60, 61, 4.5, 3, (0.1, 0.2, 0.3, 0.4, 0.5), (9, 6))
    assert np.array_equal(frames[2], METRES[2])
    assert np.array_equal(frames[0], METRES[0])
    assert np.array_equal(Frames.of(tmp_path / name, 2e-3)[1], METRES[1] * 2)


@WITH_BAGS
@pytest.mark.parametrize(
    ("depth", "encoding"),
    [(METRES, "32FC1"), (METRES.astype(">f4"), "32FC1"), (DEPTH.astype(">u2"), "mono16")],
)
def test_rows_may_be_padded_and_numbers_turned_round(
    depth: np.ndarray, encoding: str, tmp_path: Path
) -> None:
    with Bag(tmp_path / "r.bag", "bag") as bag:
        bag.images("/depth/image", depth, encoding, pad=5)
    frames = Frames.of(tmp_path / "r.bag")
    assert np.array_equal(seen(frames), METRES)
    assert frames.intrinsics == "holds no intrinsics in /depth/camera_info"


@WITH_BAGS
@WITH_PNG
def test_compressed_depth_is_the_same_depth(tmp_path: Path) -> None:
    topic = "/depth/image_raw/compressedDepth"
    with Bag(tmp_path / "r.bag", "bag") as bag:
        bag.packed(topic, DEPTH, "16UC1; compressedDepth png")
        bag.packed("/color/image_raw/compressed", DEPTH.view(np.uint8), "rgb8; jpeg compressed")
        bag.camera("/depth/camera_info", K, (9, 6))
    frames = Frames.of(tmp_path / "r.bag")
    assert np.array_equal(seen(frames), METRES)
    assert frames.intrinsics == Intrinsics(60, 61, 4.5, 3, (), (9, 6))
    with Bag(tmp_path / "bad.bag", "bag") as bag:
        bag.packed(topic, DEPTH.view(np.uint8), "16UC1; compressedDepth")
    with pytest.raises(DivespotError, match="damaged"):
        seen(Frames.of(tmp_path / "bad.bag"))
    with Bag(tmp_path / "rvl", "mcap") as bag:
        bag.packed(topic, DEPTH, "16UC1; compressedDepth rvl")
    with pytest.raises(DivespotError, match=r"no depth, but .* \(16UC1; compressedDepth rvl\)"):
        Frames.of(tmp_path / "rvl")


@WITH_BAGS
def test_a_rectified_image_has_the_lens_taken_out(tmp_path: Path) -> None:
    p = [50.0, 0.0, 4.0, 0.0, 0.0, 51.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0]
    with Bag(tmp_path / "r", "mcap") as bag:
        bag.images("/depth/image_rect", DEPTH, "16UC1")
        bag.camera("/depth/camera_info", K, (9, 6), d=[0.1] * 5, p=p)
    assert Frames.of(tmp_path / "r").intrinsics == Intrinsics(50, 51, 4, 2, (), (9, 6))


@WITH_BAGS
@pytest.mark.parametrize(
    ("kind", "unit", "value", "data"),
    [
        ("bag", "Depth Units", "std_msgs/msg/Float32", 0.00025),
        ("bag", "Depth_Units", "std_msgs/msg/Float32", 0.00025),
        ("mcap", "Depth_Units", "std_msgs/msg/String", "0.00025"),
    ],
)
def test_a_recording_of_realsense_states_its_unit(
    kind: str, unit: str, value: str, data: object, tmp_path: Path
) -> None:
    path = tmp_path / ("r.bag" if kind == "bag" else "r")
    with Bag(path, kind) as bag:
        bag.write(f"/device_0/sensor_0/option/{unit}/value", value, START_NS, data=data)
        stream = "/device_0/sensor_0/Depth_0"
        bag.camera(f"{stream}/info/camera_info", K, (9, 6), model="Brown Conrady")
        bag.images(f"{stream}/image/data", DEPTH, "mono16")
    frames = Frames.of(path)
    assert frames[0] == pytest.approx(METRES[0] / 4, rel=1e-6)
    assert frames.intrinsics == Intrinsics(60, 61, 4.5, 3, (), (9, 6))


@WITH_BAGS
@pytest.mark.parametrize(
    ("k", "model", "words"),
    [(K, "equidistant", "distortion model is 'equidistant'"), ([0.0] * 9, "", "not calibrated")],
)
def test_intrinsics_that_are_given_replace_those_that_cannot_be_used(
    k: list[float], model: str, words: str, tmp_path: Path
) -> None:
    path = tmp_path / "r.bag"
    with Bag(path, "bag") as bag:
        bag.camera("/depth/camera_info", k, (9, 6), d=[0.1] * 4, model=model)
        bag.images("/depth/image", METRES * 0, "32FC1")
    with pytest.raises(DivespotError, match=words):
        fuse(path)
    with pytest.raises(DivespotError, match="shows too little"):
        fuse(path, [60, 4.5, 3])


@WITH_BAGS
def test_of_several_topics_of_depth_one_is_to_be_named(tmp_path: Path) -> None:
    path = tmp_path / "r.bag"
    with Bag(path, "bag") as bag:
        bag.images("/a/depth", DEPTH, "16UC1")
        bag.images("/b/depth", DEPTH[::-1], "16UC1")
    with pytest.raises(DivespotError, match=r"several topics of depth, /a/depth, /b/depth: one"):
        Frames.of(path)
    assert np.array_equal(seen(Frames.of(path, topic="/b/depth")), METRES[::-1])
    with pytest.raises(DivespotError, match=r"no depth in /c, but in /a/depth, /b/depth: one"):
        Frames.of(path, topic="/c")
    said = run("fuse", path, "-o", tmp_path / "s.ply", "--depth-topic", "/b/depth").stderr
    assert "holds no intrinsics in /b/camera_info: those of the camera" in said
    with pytest.raises(DivespotError, match="a recording of ROS, which has topics"):
        fuse(DEPTH, K, depth_topic="/a")


@WITH_BAGS
def test_bad_recordings_of_ros_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.bag"
    with Bag(path, "bag") as bag:
        bag.images("/color", DEPTH.view(np.uint8), "mono8")
    with pytest.raises(DivespotError, match=r"no depth, but /color \(mono8\): images of 16UC1"):
        Frames.of(path)
    whole = path.read_bytes()
    for part in (whole[: len(whole) // 2], whole[:5], b""):
        path.write_bytes(part)
        with pytest.raises(DivespotError, match="truncated or damaged"):
            Frames.of(path)
    with pytest.raises(DivespotError, match="cannot be read"):
        Frames.of(tmp_path / "none.bag")
    with Bag(tmp_path / "r", "mcap") as bag:
        bag.images("/depth", DEPTH, "16UC1")
    mcap = tmp_path / "r" / "r.mcap"
    mcap.write_bytes(mcap.read_bytes()[:300])
    for one in (mcap, tmp_path / "r"):
        with pytest.raises(DivespotError, match="truncated or damaged"):
            seen(Frames.of(one))


@pytest.mark.parametrize(
    ("name", "module", "words"),
    [
        ("r.bag", "rosbags.highlevel", r"need rosbags, which .* divespot\[frames\]"),
        ("r.mkv", "av", r"need PyAV, which .* divespot\[kinect\]"),
    ],
)
def test_a_missing_library_is_named(
    name: str, module: str, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(DivespotError, match=words):
        Frames.of(tmp_path / name)


def test_a_sequence_of_clouds_is_of_clouds_alone(tmp_path: Path) -> None:
    for name in ("1.ply", "2.ply", "3.png"):
        (tmp_path / name).write_bytes(b"ply\n")
    assert Frames.of([tmp_path / "1.ply", tmp_path / "2.ply"]).is_clouds
    for files in (["1.ply", "3.png"], ["3.png", "1.ply"]):
        with pytest.raises(DivespotError, match=r"is a cloud|is no frame"):
            Frames.of([tmp_path / name for name in files])


@pytest.fixture(scope="module")
def bag_of_piles(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, float]:
    taken = simulate.frames("shape-05", density=0.06)
    path = tmp_path_factory.mktemp("piles") / "piles.bag"
    rows, columns = taken.depth.shape[1:]
    with Bag(path, "bag") as bag:
        bag.camera("/depth/camera_info", taken.matrix.ravel().tolist(), (columns, rows))
        bag.images("/depth/image_rect_raw", taken.depth, "16UC1")
    return path, taken.volume_m3


@WITH_BAGS
def test_the_commands_from_a_recording_to_piles(
    bag_of_piles: tuple[Path, float], tmp_path: Path
) -> None:
    bag, truth_m3 = bag_of_piles
    scan, poses = tmp_path / "scan.ply", tmp_path / "poses.txt"
    made = run("fuse", bag, "--output", scan, "--poses", poses)
    assert made.exit_code == 0, made.output
    times = np.loadtxt(poses)[:, 0]
    assert times == pytest.approx([1e-9 * (START_NS + n * PERIOD_NS) for n in range(4)], abs=2e-6)
    both = run("measure", bag, scan, "--json", tmp_path / "r.json", "--quiet")
    assert both.exit_code == 0, both.output
    for line in (tmp_path / "r.json").read_text().splitlines():
        report = json.loads(line)
        assert report["piles"][0]["volume_m3"] == pytest.approx(truth_m3, rel=0.02)
