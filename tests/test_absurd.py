"""Any argument of a public function gives a result, or an error that says what is needed."""

from __future__ import annotations

import decimal
import fractions
import inspect
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import DivespotError, evaluate, frames, plot, reproduce, simulate, volume
from divespot import io as dio
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from collections.abc import Callable

CONE = sampled(SOLIDS["cone"], 2.0**-4)

ABSURD: dict[str, Any] = {
    "None": None,
    "true": True,
    "0": 0,
    "-1": -1,
    "huge": 10**400,
    "beyond a word": 2**64,
    "nan": np.nan,
    "inf": np.inf,
    "-0.0": -0.0,
    "tiny": 5e-324,
    "largest": 1.7e308,
    "complex": 1j,
    "decimal": decimal.Decimal("NaN"),
    "fraction": fractions.Fraction(1, 3),
    "text": "text",
    "empty text": "",
    "NUL": "a\0b",
    "control": "\x1b[31m\n\r",
    "surrogate": "\udcff",
    "half a surrogate pair": "\ud800.ply",
    "long": "n" * 100_000,
    "bytes": b"\xff",
    "path": Path("none") / "none",
    "list": [],
    "dict": {},
    "set": {1},
    "object": object(),
    "class": int,
    "function": len,
    "0-d": np.array(3.0),
    "empty": np.empty((0, 3)),
    "flat": np.zeros(3),
    "narrow": np.zeros((9, 2)),
    "equal": np.ones((50, 3)),
    "deep": np.zeros((2, 2, 2, 3)),
    "nan points": np.full((50, 3), np.nan),
    "far points": np.array([[-1.7e308] * 3, [1.7e308] * 3] * 20),
    "complex points": np.ones((50, 3), complex),
    "object points": np.full((50, 3), None),
    "dates": np.zeros((50, 3), "M8[s]"),
    "records": np.zeros(50, [("x", "f8"), ("y", "f8"), ("z", "f8")]),
    "masked": np.ma.MaskedArray(np.ones((50, 3)), mask=True),
    "half": np.ones((50, 3), np.float16),
    "longdouble": np.full((50, 3), 1e4000 * np.longdouble(1)),
    "big-endian": CONE.astype(">f8"),
    "nested": [[[[1.0]]]],
    "ragged": [[1.0, 2.0], [3.0]],
}

HEIGHTS = CONE[:, 2]
MAP = divespot.height_map(CONE, 0.25)
REPORT = divespot.measure(CONE)
BODY = volume.bodies_of(REPORT)[0]

#: A scene whose scan is small at any density that is taken.
SMALL_SCENE = simulate.Scene(
    piles=(simulate.Pile(0.01),), camera=simulate.Camera(frames=1, pixels=(24, 24))
)

#: What a camera 2 m above a heap sees.
DEPTH = 2.0 - np.clip(0.4 - np.hypot(*(np.indices((24, 24)) / 12.0 - 1.0)), 0.0, None)

#: Each public function with arguments that it takes.
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "compare": (divespot.compare, {"before": CONE, "after": CONE}),
    "fit_plane": (divespot.fit_plane, {"points": CONE, "threshold_m": 0.1}),
    "ground_height": (divespot.ground_height, {"heights_m": HEIGHTS, "bin_m": 0.01}),
    "hdbscan": (divespot.hdbscan, {"points": CONE[:99]}),
    "height_histogram": (divespot.height_histogram, {"heights_m": HEIGHTS, "bin_m": 0.01}),
    "height_map": (divespot.height_map, {"points": CONE, "cell_m": 0.25}),
    "integrate": (
        divespot.integrate,
        {"heights_m": MAP.heights_m, "base_m": 0.0, "cell_m": 0.25},
    ),
    "info": (divespot.info, {"path": "scan.npy"}),
    "measure": (divespot.measure, {"source": CONE}),
    "point_spacing": (divespot.point_spacing, {"points": CONE}),
    "radius_outlier_mask": (
        divespot.radius_outlier_mask,
        {"points": CONE, "radius_m": 0.1, "min_neighbors": 3},
    ),
    "rotation_to_z": (divespot.rotation_to_z, {"normal": (0.0, 0.1, 1.0)}),
    "save_base": (divespot.save_base, {"report": REPORT, "path": "base.ply"}),
    "save_outlines": (divespot.save_outlines, {"report": REPORT, "path": "lines.geojson"}),
    "survey": (divespot.survey, {"points": CONE}),
    "voxel_downsample": (divespot.voxel_downsample, {"points": CONE, "voxel_m": 0.1}),
    "io.read": (dio.read, {"path": "scan.npy"}),
    "io.sample": (dio.sample, {"path": "scan.npy"}),
    "io.write": (dio.write, {"path": "out.ply", "points": CONE}),
    "plot.figure": (plot.figure, {"report": REPORT}),
    "plot.save_picture": (plot.save_picture, {"report": REPORT, "path": "picture.png"}),
    "plot.ground_figure": (plot.ground_figure, {"report": REPORT}),
    "plot.save_ground_picture": (
        plot.save_ground_picture,
        {"report": REPORT, "path": "picture.png"},
    ),
    "simulate.scan": (simulate.scan, {"scene": SMALL_SCENE, "density": 1.0}),
    "simulate.frames": (simulate.frames, {"scene": SMALL_SCENE, "count": 1}),
    "frames.read_intrinsics": (frames.read_intrinsics, {"path": "camera.json"}),
    "frames.read_poses": (frames.read_poses, {"path": "poses.txt"}),
    "frames.write_poses": (frames.write_poses, {"path": "out.txt", "poses": [np.eye(4)]}),
    "frames.fuse": (frames.fuse, {"depth": DEPTH, "intrinsics": (30.0, 12.0, 12.0)}),
    "simulate.scene_named": (simulate.scene_named, {"name": "shape-05"}),
    "evaluate.evaluate": (evaluate.evaluate, {"scans": "list.csv"}),
    "evaluate.goals": (evaluate.goals, {"evaluation": evaluate.Evaluation((), (), ())}),
    "evaluate.read_list": (
        evaluate.read_list,
        {"path": "list.csv", "settings": divespot.Settings()},
    ),
    "reproduce.Plan": (reproduce.Plan, {}),
    "volume.alpha_shape": (volume.alpha_shape, {"points_m": BODY.points_m, "alpha_m": 0.5}),
    "volume.bodies_of": (volume.bodies_of, {"report": REPORT}),
    "volume.hull": (volume.hull, {"points_m": BODY.points_m}),
    "volume.inner_voxels": (volume.inner_voxels, {"points_m": BODY.points_m, "voxel_m": 0.1}),
    "volume.volumes_m3": (volume.volumes_m3, {"report": REPORT, "method": "hull"}),
    "volume.slices": (volume.slices, {"points_m": BODY.points_m, "slice_m": 0.05}),
    "volume.tin": (volume.tin, {"points_m": BODY.points_m, "outline_m": BODY.outline_m}),
    "Report.to_json": (REPORT.to_json, {}),
    "Report.from_json": (divespot.Report.from_json, {"text": "{}"}),
    "Report.save": (REPORT.save, {"path": "report.csv"}),
}

#: The errors of a callback are its own; without a list, all scenes are measured; a truth is checked
#: by `figure`, which draws without writing.
NOT_TRIED = {
    ("plot.save_picture", "truth_m3"),
    ("compare", "on_stage"),
    ("measure", "on_stage"),
    ("frames.fuse", "on_frame"),
    ("evaluate.evaluate", "on_round"),
    ("evaluate.evaluate", "scans"),
}

#: Take minutes; their arguments are checked by what they call.
NOT_CALLED = {"evaluate.run_rounds", "reproduce.reproduce"}

MODULES = (divespot, dio, evaluate, frames, plot, reproduce, simulate, volume)

PARAMETERS = [
    (name, parameter)
    for name, (call, _) in CALLS.items()
    for parameter, item in inspect.signature(call).parameters.items()
    if item.kind is not inspect.Parameter.VAR_KEYWORD and (name, parameter) not in NOT_TRIED
]


def test_every_public_function_is_tried() -> None:
    functions = {
        f"{module.__name__}.{name}".removeprefix("divespot.")
        for module in MODULES
        for name in getattr(module, "__all__", ("figure", "save_picture"))
        if inspect.isfunction(getattr(module, name))
    }
    assert functions <= set(CALLS) | NOT_CALLED


@pytest.mark.parametrize(("name", "parameter"), PARAMETERS)
def test_any_argument_ends_well(
    name: str, parameter: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("scan.npy", CONE)
    Path("list.csv").write_text("path,volume_m3\nscan.npy,1.0\n", encoding="utf-8")
    call, arguments = CALLS[name]
    for value in ABSURD.values():
        require_ends_well(call, {**arguments, parameter: value})


@pytest.mark.parametrize("name", [item for item in vars(divespot.Settings()) if item != "level"])
def test_any_setting_ends_well(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for value in ABSURD.values():
        require_ends_well(divespot.measure, {"source": CONE, name: value})


@pytest.mark.parametrize("name", vars(divespot.Stages()))
def test_any_parameter_of_the_paper_ends_well(name: str) -> None:
    def measure(**changes: Any) -> divespot.Report:  # noqa: ANN401 - anything at all
        return divespot.measure(CONE, divespot.Settings.paper(**changes))

    for value in ABSURD.values():
        require_ends_well(measure, {name: value})


def require_ends_well(call: Callable[..., Any], arguments: dict[str, Any]) -> None:
    try:
        call(**arguments)
    except (DivespotError, MemoryError) as error:
        sentence = str(error)
    except TypeError:
        return
    else:
        return
    assert len(sentence) <= 500
    assert sentence.isprintable()


def test_an_error_is_a_value_error_of_one_short_line() -> None:
    error = DivespotError("a\n b\x1b[31m" + "n" * 10_000 + " is needed")
    assert isinstance(error, ValueError)
    assert str(error).startswith("a b")
    assert str(error).endswith("is needed")
    assert str(error).isprintable()
    assert len(str(error)) == 500
