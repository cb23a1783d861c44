"""Recordings of Azure Kinect as frames: depth, intrinsics and times come back as written."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

from divespot import DivespotError
from divespot.cli import main
from divespot.extras import is_installed
from divespot.frames import Intrinsics, fuse
from divespot.frames.source import Frames
from recordings import write_mkv

if TYPE_CHECKING:
    from pathlib import Path

WITH_MKV = pytest.mark.skipif(not is_installed("av"), reason="PyAV is not installed")

CAMERA: dict[str, Any] = {
    "Purpose": "CALIBRATION_CameraPurposeDepth",
    "SensorWidth": 1024,
    "SensorHeight": 1024,
    "Intrinsics": {
        "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
        # Of a device whose SDK said: cx 332.064270, cy 325.880615, fx 503.927643, fy 503.978729.
        "ModelParameters": [
            *(0.5122697949409485, 0.49451231956481934, 0.4921168386936188, 0.4921667277812958),
            *(3.1305770874023438, 2.324939012527466, 0.1304156482219696, 3.4586516425136),
            *(3.350114583969116, 0.6629416346549988, 0, 0),
            *(-0.0000511557373101823, 0.00008132171933539212),
        ],
    },
}
COLOUR = {**CAMERA, "Purpose": "CALIBRATION_CameraPurposePhotoVideo"}
CALIBRATION = {"CalibrationInformation": {"Cameras": [COLOUR, CAMERA]}}


def seen(frames: Frames) -> np.ndarray:
    return np.stack(list(frames))


def kinect(rows: int = 576, columns: int = 640) -> np.ndarray:
    return np.random.default_rng(1).integers(0, 65_535, (2, rows, columns)).astype(np.uint16)


@WITH_MKV
def test_a_recording_of_azure_kinect_gives_back_what_was_recorded(tmp_path: Path) -> None:
    path, depth = tmp_path / "r.mkv", kinect()
    write_mkv(path, {"IR": depth[::-1], "DEPTH": depth}, CALIBRATION)
    frames = Frames.of(path)
    assert np.array_equal(seen(frames), depth.astype(np.float32) * np.float32(1e-3))
    assert frames.times_s == (0.0, 0.033)
    lens = frames.intrinsics
    assert isinstance(lens, Intrinsics)
    assert (lens.cx, lens.cy, lens.fx, lens.fy) == pytest.approx(
        (332.064270, 325.880615, 503.927643, 503.978729), abs=1e-4
    )
    assert lens.distortion[:4] == pytest.approx((3.130577, 2.324939, 8.1322e-5, -5.1156e-5), 1e-4)
    assert lens.size == (640, 576)


@WITH_MKV
def test_a_binned_mode_sees_the_same_rays(tmp_path: Path) -> None:
    write_mkv(tmp_path / "r.mkv", {"DEPTH": kinect(288, 320)}, CALIBRATION)
    lens = Frames.of(tmp_path / "r.mkv").intrinsics
    assert isinstance(lens, Intrinsics)
    assert (lens.cx, lens.cy) == pytest.approx((165.782135, 162.690308), abs=1e-4)
    assert lens.fx == pytest.approx(503.927643 / 2, abs=1e-4)


def other_lens() -> dict[str, Any]:
    intrinsics = {**CAMERA["Intrinsics"], "ModelType": "CALIBRATION_LensDistortionModelTheta"}
    return {"CalibrationInformation": {"Cameras": [{**CAMERA, "Intrinsics": intrinsics}]}}


@WITH_MKV
@pytest.mark.parametrize("calibration", [None, {}, [1], other_lens()])
def test_without_a_calibration_intrinsics_are_asked_for(
    calibration: object, tmp_path: Path
) -> None:
    write_mkv(tmp_path / "r.mkv", {"DEPTH": kinect(288, 320)}, calibration)
    with pytest.raises(DivespotError, match=r"no calibration .* are needed \(--intrinsics\)"):
        fuse(tmp_path / "r.mkv")
    write_mkv(tmp_path / "r.mkv", {"DEPTH": kinect(12, 16)}, CALIBRATION)  # no mode of the device
    said = CliRunner().invoke(main, ["measure", str(tmp_path / "r.mkv")]).stderr
    assert said.count("--intrinsics") == 1


@WITH_MKV
def test_bad_recordings_of_azure_kinect_are_refused(tmp_path: Path) -> None:
    path, depth = tmp_path / "r.mkv", kinect(288, 320)
    write_mkv(path, {"A": depth, "B": depth})
    with pytest.raises(DivespotError, match=r"2 tracks of depth, of A \(gray16be\), B"):
        Frames.of(path)
    write_mkv(path, {"DEPTH": depth})
    whole = path.read_bytes()
    cut = len(whole) - 1000
    for length, words in (
        (cut, f"truncated: {len(whole)} bytes are needed, {cut} are"),
        (0, "damaged, or no"),
    ):
        path.write_bytes(whole[:length])
        with pytest.raises(DivespotError, match=words):
            seen(Frames.of(path))
    with pytest.raises(DivespotError, match="cannot be read"):
        Frames.of(tmp_path / "none.mkv")
