"""Input that is no scan of a pile: `measure` raises an error of one sentence, or warns."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from functools import partial
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

import divespot
from cases import WRONG_POINTS
from divespot import DivespotError, Report, Settings
from reports import objects, result
from solids import SOLIDS, Floats, raster, sampled, turned

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

COARSE_M = 2.0**-5
CONE = sampled(SOLIDS["cone"], COARSE_M)


def flat() -> Floats:
    x, y = raster(40, 40)
    return np.column_stack([x, y, 0 * x])


def refusal(call: Callable[[], Report]) -> str:
    """Return the one sentence with which a call is refused."""
    with pytest.raises(DivespotError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text
    assert 20 < len(text) < 1000
    return text


REFUSED = {
    "0 points": (np.empty((0, 3)), "of 0 points .* at least 10 others are needed"),
    "3 points": (np.eye(3), "of 3 points .* at least 10 others are needed"),
    "9 points": (np.eye(9)[:, :3] + 1, "of 9 points .* at least 10 others are needed"),
    "all NaN": (np.full((50, 3), np.nan), "of 50 points 50 are not finite"),
    "all infinite": (np.full((50, 3), -np.inf), "of 50 points 50 are not finite"),
    "all (0, 0, 0)": (np.zeros((50, 3)), r"50 are \(0, 0, 0\)"),
    "9 among bad": (np.r_[np.ones((9, 3)), np.full((9, 3), np.nan), np.zeros((9, 3))], "of 27 "),
    "all equal": (np.full((100, 3), 2.5), "span 0 m: at least 1e-06 m is needed"),
    "two points": (np.repeat([[0, 0, 1.0], [1, 1, 1]], 100, axis=0), "2 usable points"),
    "collinear": (np.arange(200.0)[:, None] * [0.01, 0.02, -0.005] + 1, "one line"),
    "upright line": (np.arange(200.0)[:, None] * [0, 0, 0.01] + 1, "one line"),
    "too wide": (flat() * 1e10, "at most 1e9 m"),
    "far too wide": (flat() * 1e300, "at most 1e9 m"),
    "too small": (flat() * 1e-9, "at least 1e-06 m is needed"),
    "one stray far away": (np.r_[flat(), [[1e12, 0, 0]]], "at most 1e9 m"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_measured_is_refused_in_one_sentence(name: str) -> None:
    points, message = REFUSED[name]
    with pytest.raises(DivespotError, match=message):
        divespot.measure(points)
    assert "need" in refusal(lambda: divespot.measure(points))


@pytest.mark.parametrize("name", sorted(set(WRONG_POINTS) - {"too wide"}))
def test_what_is_no_cloud_is_refused(name: str) -> None:
    text = refusal(lambda: divespot.measure(WRONG_POINTS[name]))  # type: ignore[arg-type]
    assert "points" in text


@pytest.mark.parametrize(
    "points", [{}, {1, 2}, 5, b"abc", [], [[]], (i for i in range(3)), object()]
)
def test_other_objects_are_refused(points: object) -> None:
    assert "points" in refusal(lambda: divespot.measure(points))  # type: ignore[arg-type]


NO_PILE: Mapping[str, Floats] = {
    "flat": flat(),
    "rough": flat() + np.random.default_rng(0).normal(0, 0.002, flat().shape),
    "wall": flat()[:, [0, 2, 1]] + [0, 1, 0],
    "tilted": turned(flat()[:, [1, 2, 0]], 35)[:, [2, 0, 1]],
    "1e9 wide": flat() * 5e8,
    "1e-5 wide": flat() * 1e-5,
    "one stray": np.r_[flat(), [[1e5, 1e5, 1e5]]],
}


def test_a_cloud_without_a_surface_shows_no_ground() -> None:
    with pytest.raises(DivespotError, match=r"no ground is in view|which way is up"):
        divespot.measure(np.random.default_rng(0).uniform(0, 1, (3000, 3)))


@pytest.mark.parametrize("name", NO_PILE)
def test_where_no_pile_is_there_is_a_warning(name: str) -> None:
    report = divespot.measure(NO_PILE[name])
    assert not report.piles
    assert any("no pile was found" in warning for warning in report.warnings)
    assert report.total == divespot.Total(0, 0, None, None)
    assert json.loads(report.to_json())["total"]["volume_m3"] == 0


def test_bad_points_are_dropped_and_counted() -> None:
    bad = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [0, 0, 0], [0.0, -0.0, 0]]
    mixed = np.r_[CONE, bad][np.random.default_rng(0).permutation(len(CONE) + 5)]
    report, clean = divespot.measure(mixed), divespot.measure(CONE)
    assert (report.source.points, report.source.dropped_nonfinite) == (len(CONE) + 5, 3)
    assert report.source.dropped_zero == 2
    assert result(report) | {"source": None} == result(clean) | {"source": None}


@pytest.mark.parametrize("kind", [np.int64, np.int16, np.uint32])
def test_whole_numbers_and_lists_are_points_too(kind: type[np.integer[Any]]) -> None:
    whole: NDArray[Any] = np.round((CONE + np.array([1, 1, 0])) * 1024).astype(kind)
    expected = result(divespot.measure(whole.astype(float)))
    assert result(divespot.measure(whole)) == expected
    assert result(divespot.measure(whole.tolist())) == expected


@dataclass
class Holder:
    """What holds points as Open3D's clouds do."""

    points: object


def test_a_cloud_of_open3d_is_taken() -> None:
    legacy = Holder(CONE.tolist())
    positions = SimpleNamespace(cpu=lambda: SimpleNamespace(numpy=lambda: CONE))
    tensor = SimpleNamespace(point=SimpleNamespace(positions=positions))
    expected = result(divespot.measure(CONE))
    assert result(divespot.measure(legacy)) == expected
    assert result(divespot.measure(tensor)) == expected
    text = refusal(lambda: divespot.measure(Holder("none")))
    assert text.startswith("points have shape ()")


def test_an_unknown_setting_is_named_with_those_that_are() -> None:
    unknown: Any = {"voxel": 0.1}
    text = refusal(lambda: divespot.measure(CONE, **unknown))
    assert "'voxel'" in text
    assert "cell_m" in text


WRONG = [-1, float("nan"), float("inf"), "", "wide", b"x", [], {}, object(), (1, 2)]


@pytest.mark.parametrize("name", [item.name for item in fields(Settings)])
def test_wrong_values_of_a_setting_are_refused_by_name(name: str) -> None:
    for value in WRONG:
        if (name == "outline" and isinstance(value, str)) or (name, value) == ("stages", {}):
            continue
        changes: Any = {name: value}
        text = refusal(partial(divespot.measure, CONE, **changes))
        assert text.startswith(f"{name} is ")
        assert "needed" in text


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("unit", "furlong"),
        ("up", "sideways"),
        ("up", "1,2"),
        ("up", "0,0,0"),
        ("up", "nan,0,0"),
        ("crop", (0, 0, 0, 1, 1)),
        ("crop", (0, 0, 0, 1, -1, 1)),
        ("crop", "0,0,0,1,1,1"),
        ("inside", (0, 0, 1)),
        ("inside", (0, 0, 1, -1)),
        ("inside", (0, 0, 1, float("nan"))),
        ("window", 4),
        ("hypotheses", 0),
        ("hypotheses", 1.5),
        ("min_cluster_size", 1),
        ("min_samples", 0),
        ("lower_fraction", 0),
        ("lower_fraction", 1.5),
        ("scene_cluster", 1),
        ("cell_m", 0),
        ("cell_m", True),
        ("base", "Local"),
        ("base", "height"),
        ("base", "height=high"),
        ("base", "height=inf"),
        ("base", "camera-height=0"),
        ("base", "surface="),
        ("base", 0.5),
        ("outline", 3),
        ("outline", ""),
        ("compare_bases", "yes"),
        ("material", "gold"),
        ("seed", 0.5),
    ],
)
def test_values_out_of_range_are_refused_by_name(name: str, value: object) -> None:
    changes: Any = {name: value}
    text = refusal(lambda: divespot.measure(CONE, Settings().tuned(**changes)))
    assert "needed" in text
    assert name in text


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"crop": (9.0, 9.0, 9.0, 10.0, 10.0, 10.0)}, "crop keeps 0 of"),
        ({"radius_m": 1e-6}, "no point has . neighbours .* needed"),
        ({"cell_m": 1e-7}, "a larger cell_m, .* is needed"),
        ({"bin_m": 1e-12}, "a larger bin_m, .* is needed"),
        ({"up": "x", "max_tilt_deg": 5.0, "plane_threshold_m": 1e-4}, "admissible tilt"),
    ],
)
def test_settings_that_leave_nothing_are_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(DivespotError, match=message):
        divespot.measure(CONE, Settings().tuned(**changes))


NUMBERS = st.one_of(
    st.floats(-1, 1),
    st.sampled_from([0.0, -0.0, np.nan, np.inf, -np.inf, 1e300, -1e300, 1e9, 1e-9, 5e-324, 0.1]),
)


@settings(max_examples=60, deadline=5000, suppress_health_check=[HealthCheck.too_slow])
@given(
    points=st_numpy.arrays(
        st.sampled_from([np.float32, np.float64]),
        st.tuples(st.integers(0, 80), st.just(3)),
        elements=NUMBERS.map(lambda v: float(np.float32(max(min(v, 3e38), -3e38)))),
    ),
    changes=st.fixed_dictionaries(
        {},
        optional={
            "radius_m": st.sampled_from([0.0, 1e-9, 0.3, 1e9]),
            "cell_m": st.sampled_from([1e-3, 0.1, 1e8]),
            "voxel_m": st.sampled_from([None, 0.1]),
            "select": st.sampled_from(["all", "largest"]),
            "base": st.sampled_from(["local", "plane", "peak", "midpeak", "height=0.1"]),
            "compare_bases": st.booleans(),
            "up": st.sampled_from(["auto", "-z", "1,2,3"]),
            "min_cluster_size": st.integers(2, 5),
        },
    ),
)
def test_any_few_points_end_in_a_report_or_one_sentence(
    points: Floats, changes: dict[str, Any]
) -> None:
    try:
        report = divespot.measure(points, Settings().tuned(**changes))
    except DivespotError as error:
        assert "\n" not in str(error)  # noqa: PT017 - the only error there may be
    else:
        assert report.piles or report.warnings
        json.loads(report.to_json())


@settings(max_examples=40, deadline=5000)
@given(
    scale=st.sampled_from([1e-5, 1e-3, 1.0, 1e3, 1e8]),
    lumps=st.lists(st.tuples(*[st.floats(-0.9, 0.9)] * 2, st.floats(0.02, 0.5)), max_size=4),
    holes=st.integers(0, 9),
    seed=st.integers(0, 99),
)
def test_any_heaps_on_a_floor_end_in_a_report(
    scale: float, lumps: list[tuple[float, float, float]], holes: int, seed: int
) -> None:
    x, y = raster(32, 32, COARSE_M)
    z = np.zeros_like(x)
    for at_x, at_y, height in lumps:
        z = np.maximum(z, height - 0.6 * np.hypot(x - at_x, y - at_y))
    assume(np.mean(z == 0.0) > 0.3)  # of less no ground need be found
    points = np.column_stack([x, y, z + np.random.default_rng(seed).normal(0, 1e-3, x.size)])
    points[:: holes + 1][: 30 * holes] = np.nan
    for found in objects(divespot.measure(points * scale)):
        assert 0 < found.footprint_m2 <= 5 * scale**2
        assert np.isfinite(found.volume_m3)
        assert np.isfinite(found.u95_m3)
