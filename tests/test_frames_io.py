"""Depth frames, intrinsics and poses as users have them; the commands that take them."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from divespot import DivespotError
from divespot.cli import main
from divespot.extras import is_installed
from divespot.frames import Intrinsics, fuse, read_intrinsics, read_poses, write_poses
from divespot.frames.source import Frames, write_png
from divespot.simulate.pose import rotation

if TYPE_CHECKING:
    from pathlib import Path

WITH_PNG = pytest.mark.skipif(not is_installed("PIL.Image"), reason="Pillow is not installed")
LENS = (0.5, -2.6, 0.0006, -0.0002, 1.5, 0.4, -2.4, 1.4)  # k1 k2 p1 p2 k3 .. k6, as of a Kinect
K = [600.0, 0.0, 320.5, 0.0, 601.0, 241.0, 0.0, 0.0, 1.0]


def run(*args: str | Path) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args], prog_name="divespot")


DIALECTS: dict[str, dict[str, Any]] = {
    "Open3D": {
        "width": 640,
        "height": 480,
        "intrinsic_matrix": [600.0, 0.0, 0.0, 0.0, 601.0, 0.0, 320.5, 241.0, 1.0],
    },
    "RealSense": {"width": 640, "height": 480, "fx": 600, "fy": 601, "ppx": 320.5, "ppy": 241},
    "RealSense with a lens": {
        "width": 640,
        "height": 480,
        "fx": 600,
        "fy": 601,
        "ppx": 320.5,
        "ppy": 241,
        "model": "distortion.brown_conrady",
        "coeffs": [0, 0, 0, 0, 0],
    },
    "ROS": {
        "width": 640,
        "height": 480,
        "K": K,
        "D": [0.0] * 5,
        "distortion_model": "plumb_bob",
    },
    "ROS 2": {"width": 640, "height": 480, "k": K, "d": [], "distortion_model": ""},
    "inside": {
        "depth": {"width": 640, "height": 480, "fx": 600, "fy": 601, "cx": 320.5, "cy": 241}
    },
}


@pytest.mark.parametrize("name", DIALECTS)
def test_the_dialects_of_intrinsics_say_the_same(name: str, tmp_path: Path) -> None:
    file = tmp_path / "K.json"
    file.write_text(json.dumps(DIALECTS[name]))
    assert read_intrinsics(file) == Intrinsics(600, 601, 320.5, 241, (), (640, 480))


def test_azure_kinect_has_eight_coefficients_in_two_orders(tmp_path: Path) -> None:
    k1, k2, p1, p2, k3, k4, k5, k6 = LENS
    expected = Intrinsics(600, 601, 320.5, 241, LENS)
    struct = [320.5, 241, 600, 601, k1, k2, k3, k4, k5, k6, 0, 0, p2, p1, 0]
    ros = {"K": K, "D": list(LENS), "distortion_model": "rational_polynomial"}
    for values in ({"parameters": struct}, ros):
        (tmp_path / "K.json").write_text(json.dumps(values))
        assert read_intrinsics(tmp_path / "K.json") == expected


def test_yaml_of_ros_and_numbers_are_intrinsics_too(tmp_path: Path) -> None:
    pytest.importorskip("yaml")
    file = tmp_path / "K.yaml"
    data = ", ".join(map(str, K))
    file.write_text(
        f"%YAML:1.0\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n"
        f"  rows: 3\n  cols: 3\n  data: [{data}]\ndistortion_model: plumb_bob\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}\n"
    )
    lens = (0.1, 0.0, 0.0, 0.0, 0.0)
    assert read_intrinsics(file) == Intrinsics(600, 601, 320.5, 241, lens, (640, 480))
    assert Intrinsics.of([600, 320.5, 241]) == Intrinsics(600, 600, 320.5, 241)
    assert Intrinsics.of([600, 601, 320.5, 241]) == Intrinsics(600, 601, 320.5, 241)
    assert Intrinsics.of(np.reshape(K, (3, 3))) == Intrinsics(600, 601, 320.5, 241)


def test_rays_are_what_the_lens_maps_to_their_pixels() -> None:
    lens = Intrinsics(600, 601, 320.5, 241, LENS)
    rays = lens.rays(480, 640)
    assert np.abs(np.linalg.norm(rays, axis=1) - 1).max() < 1e-12
    x, y = lens.distorted((rays[:, :2] / rays[:, 2:]).T)
    u, v = np.meshgrid(np.arange(640), np.arange(480))
    assert np.abs(600 * x + 320.5 - u.ravel()).max() < 2e-3
    assert np.abs(601 * y + 241 - v.ravel()).max() < 2e-3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("{", "no valid JSON"),
        ("[1]", "no object"),
        ("{}", "holds no intrinsics"),
        ('{"intrinsic_matrix": [1, 2]}', "2 numbers"),
        ('{"fx": "a", "fy": 1, "cx": 1, "cy": 1}', "no numbers"),
        ('{"fx": 0, "fy": 1, "cx": 1, "cy": 1}', "above 0"),
        ('{"fx": 1, "fy": 1, "cx": 1, "cy": 1, "coeffs": [1], "model": "fov"}', "'fov'"),
    ],
)
def test_bad_intrinsics_are_refused(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "K.json"
    file.write_text(text)
    with pytest.raises(DivespotError, match=words):
        read_intrinsics(file)
    with pytest.raises(DivespotError, match="cannot be read"):
        read_intrinsics(tmp_path / "none.json")


def poses() -> np.ndarray:
    found = np.tile(np.eye(4), (3, 1, 1))
    for number, pose in enumerate(found):
        pose[:3, :3] = rotation(170 + 20 * number, 30 * number, -50)
        pose[:3, 3] = (0.1 * number, -2.0, 1.4)
    return found


def test_poses_of_three_kinds_are_the_same(tmp_path: Path) -> None:
    write_poses(tmp_path / "tum.txt", list(poses()))
    np.savetxt(tmp_path / "kitti.txt", poses()[:, :3].reshape(3, 12))
    np.savetxt(tmp_path / "lines.txt", poses().reshape(3, 16), delimiter=",", header="a comment")
    for name in ("tum", "kitti", "lines"):
        assert np.abs(read_poses(tmp_path / f"{name}.txt") - poses()).max() < 1e-7


def test_a_pose_is_that_next_in_time(tmp_path: Path) -> None:
    write_poses(tmp_path / "tum.txt", list(poses()), [10.0, 10.1, 10.2])
    found = read_poses(tmp_path / "tum.txt", [10.11, 10.0, 10.5])
    assert np.abs(found[:2] - poses()[[1, 0]]).max() < 1e-7
    assert np.isnan(found[2]).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 2 3", "line 1 is no pose"),
        ("# only this\n", "8, 12 or 16"),
        ("0 0 0 0 0 0 0 1\n" + " 1" * 12, "as many numbers"),
        ("0 0 0 0 0 0 0 0", "no rigid motion"),
        ("0 0 0 nan 0 0 0 1", "line 1 is no pose"),
    ],
)
def test_bad_poses_are_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "poses.txt").write_text(text)
    with pytest.raises(DivespotError, match=words):
        read_poses(tmp_path / "poses.txt")


@WITH_PNG
def test_folders_lists_and_stacks_hold_the_same_frames(tmp_path: Path) -> None:
    depth = np.arange(3 * 20, dtype=np.uint16).reshape(3, 4, 5) + 1000
    files = [tmp_path / name for name in ("a2.png", "a10.png", "a1.png")]
    for file, frame in zip(files, (depth[1], depth[2], depth[0]), strict=True):
        write_png(file, frame)
    np.save(tmp_path / "stack.npy", depth)
    np.savez(tmp_path / "stack.npz", other=depth[0], depth=depth)
    in_order = [str(tmp_path / name) for name in ("a1.png", "a2.png", "a10.png")]
    folder = tmp_path / "folder"
    folder.mkdir()
    for file in files:
        (folder / file.name).write_bytes(file.read_bytes())
    sources = (folder, in_order, tmp_path / "stack.npy", tmp_path / "stack.npz", depth)
    for source in sources:
        frames = Frames.of(source)
        assert np.array_equal(np.stack(list(frames)), depth.astype(np.float32) * np.float32(1e-3))
    assert Frames.of(depth[0], 0.0002)[0][0, 0] == pytest.approx(0.2)
    depth[0, 0, 0] = 65_535
    assert Frames.of(depth)[0][0, 0] == 0.0
    write_png(tmp_path / "1305031102.160407.png", depth[0])
    assert Frames.of([tmp_path / "1305031102.160407.png"]).times_s == (1305031102.160407,)


@WITH_PNG
@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("f.png", b"\x89PNG\r\n\x1a\n....", "damaged|cannot be read"),
        ("f.jpg", b"", "is no frame: depth of 16 bits"),
        ("f.npy", b"x", "no array"),
    ],
)
def test_bad_images_are_refused(name: str, data: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(DivespotError, match=words):
        list(Frames.of(tmp_path / name))
    (tmp_path / "empty").mkdir()
    with pytest.raises(DivespotError, match="holds no frames"):
        Frames.of(tmp_path / "empty")


@WITH_PNG
def test_colours_and_other_sizes_are_no_depth(tmp_path: Path) -> None:
    from PIL import Image  # noqa: PLC0415 - may be absent

    Image.fromarray(np.zeros((4, 5), np.uint8)).save(tmp_path / "1.png")
    with pytest.raises(DivespotError, match="8 bits"):
        list(Frames.of(tmp_path))
    write_png(tmp_path / "1.png", np.full((4, 5), 1000, np.uint16))
    write_png(tmp_path / "2.png", np.full((5, 5), 1000, np.uint16))
    with pytest.raises(DivespotError, match=r"5 x 5 pixels: 5 x 4|shows too little"):
        fuse(tmp_path, [100, 2, 2])


@WITH_PNG
def test_the_commands_from_simulated_frames_to_piles(tmp_path: Path) -> None:
    folder, scan = tmp_path / "frames", tmp_path / "scan.ply"
    made = run("simulate", "shape-05", "--frames", folder, "--density", "0.06", "--truth", "-")
    assert made.exit_code == 0, made.output
    truth = json.loads(made.stdout)["volume_m3"]
    intrinsics = folder / "intrinsics.json"
    found = run("fuse", folder, "--intrinsics", intrinsics, "-o", scan, "--poses", tmp_path / "p")
    assert found.exit_code == 0, found.output
    assert re.search(r"scan\.ply: [\d,]+ points of 4 frames, heights ± ", found.stdout)
    assert len(read_poses(tmp_path / "p")) == 4
    for args in ((scan,), (folder, "--intrinsics", intrinsics)):
        report = json.loads(run("measure", *args, "--json", "-").stdout)
        assert report["piles"][0]["volume_m3"] == pytest.approx(truth, rel=0.02)
    again = run("simulate", "shape-05", "--frames", folder, "--density", "0.06")
    assert again.exit_code == 1
    assert "not empty" in again.stderr
    known = folder / "poses.txt"
    exact = ("--known-poses", known, "--exact-poses")
    kept = run("fuse", folder, "--intrinsics", intrinsics, "-o", scan, *exact)
    assert kept.exit_code == 0, kept.output


def test_the_commands_refuse_what_does_not_go_together(tmp_path: Path) -> None:
    (tmp_path / "K.json").write_text(json.dumps(DIALECTS["RealSense"]))
    np.save(tmp_path / "f.npy", np.ones((1, 9, 9)))
    assert run("fuse", tmp_path, "-o", "x.ply").exit_code == 2
    assert run("simulate", "shape-05").exit_code == 2
    assert run("measure", tmp_path, "--exact-poses").exit_code == 2
    assert "intrinsics where it holds depth frames" in run("measure", tmp_path).stderr
    wrong = run("measure", tmp_path / "f.npy", "--intrinsics", tmp_path / "K.json")
    assert wrong.exit_code == 1
    assert "9 x 9 pixels, the intrinsics are for 640 x 480" in wrong.stderr
    over = tmp_path / "f.npy"
    args = ("fuse", over, "--intrinsics", tmp_path / "K.json", "-o", over)
    assert "would overwrite an input" in run(*args).stderr
