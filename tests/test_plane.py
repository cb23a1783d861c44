"""Plane fits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import divespot
import slow
from cases import UTM, WRONG_POINTS, with_holes
from divespot import DivespotError

TILTS = [(0.0, 0.0, 1.0), (0.3, -0.2, 0.9), (1.0, 0.0, 0.0), (0.0, -1.0, 1e-3), (-0.5, 0.5, 0.7)]


def plane_with_strays(normal: tuple[float, float, float], seed: int = 0) -> slow.Floats:
    """Return 3,000 points within 3 mm of a plane 0.7 m from the origin, and 900 anywhere."""
    rng = np.random.default_rng(seed)
    unit = np.array(normal) / np.linalg.norm(normal)
    across = np.linalg.svd(unit[None])[2][1:]
    flat = rng.uniform(-1, 1, (3000, 2)) @ across
    on = flat + np.outer(0.7 + np.clip(rng.normal(0, 0.001, 3000), -0.003, 0.003), unit)
    return np.concatenate([on, rng.uniform(-1, 1, (900, 3))])


@pytest.mark.parametrize("normal", TILTS)
def test_the_fit_is_least_squares_of_its_inliers(normal: tuple[float, float, float]) -> None:
    points = plane_with_strays(normal)
    plane = divespot.fit_plane(points, 0.01)
    expected, offset_m, rms_m = slow.plane(points[np.abs(plane.heights_m(points)) <= 0.01])
    assert abs(float(expected @ plane.normal)) == pytest.approx(1, abs=1e-12)
    sign = np.sign(expected @ plane.normal)
    assert plane.offset_m == pytest.approx(sign * offset_m, abs=1e-9)
    assert plane.rms_m == pytest.approx(rms_m, rel=1e-6)
    assert plane.inliers == np.count_nonzero(np.abs(plane.heights_m(points)) <= 0.01)


@pytest.mark.parametrize("normal", TILTS)
def test_the_plane_is_the_true_one(normal: tuple[float, float, float]) -> None:
    plane = divespot.fit_plane(plane_with_strays(normal), 0.005)
    unit = np.array(normal) / np.linalg.norm(normal)
    assert np.degrees(np.arccos(min(1, abs(float(unit @ plane.normal))))) < 0.02
    assert abs(plane.offset_m) == pytest.approx(0.7, abs=1e-4)
    assert np.linalg.norm(plane.normal) == pytest.approx(1, abs=1e-14)
    assert plane.normal[2] >= 0


def test_the_largest_of_two_planes_is_taken_and_an_axis_selects() -> None:
    floor = plane_with_strays((0, 0, 1))[:3000]
    wall = plane_with_strays((1, 0, 0), seed=1)[:2000]
    both = np.r_[floor, wall]
    assert divespot.fit_plane(both, 0.01).normal[2] > 0.9999
    assert divespot.fit_plane(both, 0.01, axis=(-1, 0, 0.2), max_tilt_deg=30).normal[0] < -0.999
    down = divespot.fit_plane(both, 0.01, axis=(0, 0, -2), max_tilt_deg=30)
    assert down.normal[2] < -0.9999
    assert down.offset_m == pytest.approx(-0.7, abs=1e-3)


def test_no_plane_within_the_tilt_is_an_error() -> None:
    flat = plane_with_strays((0, 0, 1))[:300]
    with pytest.raises(DivespotError, match="no plane within the admissible tilt"):
        divespot.fit_plane(flat, 0.003, axis=(1, 0, 0), max_tilt_deg=10)


def test_order_threads_and_holes_do_not_count_but_the_seed_does() -> None:
    points = plane_with_strays((0.3, -0.2, 0.9))
    expected = divespot.fit_plane(points, 0.01, seed=4)
    order = np.random.default_rng(1).permutation(len(points))
    assert divespot.fit_plane(points[order], 0.01, seed=4) == expected
    for threads in (1, 2, 5):
        assert divespot.fit_plane(points, 0.01, seed=4, threads=threads) == expected
    holes = np.repeat(points, 2, axis=0)
    holes[::2] = np.nan
    assert divespot.fit_plane(holes, 0.01, seed=4) == expected
    anywhere = np.random.default_rng(2).uniform(0, 1, (500, 3))
    assert (
        len({divespot.fit_plane(anywhere, 0.1, seed=seed, hypotheses=3) for seed in range(5)}) > 1
    )


def test_far_from_the_origin_the_plane_is_the_same() -> None:
    points = np.round(plane_with_strays((0.3, -0.2, 0.9)) * 2**20) / 2**20
    near, far = divespot.fit_plane(points, 0.01), divespot.fit_plane(points + UTM, 0.01)
    np.testing.assert_allclose(far.normal, near.normal, rtol=0, atol=1e-12)
    assert far.inliers == near.inliers
    assert far.rms_m == pytest.approx(near.rms_m, rel=1e-6)
    shift = float(np.dot(near.normal, UTM))
    assert far.offset_m == pytest.approx(near.offset_m + shift, abs=1e-5)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (np.empty((0, 3)), "0 usable points .* at least 3 are needed for a plane"),
        (np.eye(3)[:2], "2 usable points .* at least 3 are needed for a plane"),
        (with_holes(np.full((40, 3), np.nan)), "0 usable points"),
        (np.arange(300.0)[:, None] * [1, 2, -3], "one line"),
        (np.full((300, 3), 0.1), "one line"),
    ],
)
def test_clouds_without_a_plane_are_refused(points: slow.Floats, message: str) -> None:
    with pytest.raises(DivespotError, match=message):
        divespot.fit_plane(points, 0.01)


@pytest.mark.parametrize("name", WRONG_POINTS)
def test_what_is_no_cloud_is_refused(name: str) -> None:
    with pytest.raises(DivespotError, match="points"):
        divespot.fit_plane(WRONG_POINTS[name], 0.01)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("threshold_m", 0.0),
        ("threshold_m", float("nan")),
        ("threshold_m", "wide"),
        ("hypotheses", -1),
        ("hypotheses", 1.5),
        ("axis", (0, 0, 0)),
        ("axis", (0, 0)),
        ("axis", "up"),
        ("axis", (0, 0, float("inf"))),
        ("seed", -1),
        ("threads", 0.5),
    ],
)
def test_settings_out_of_range_are_named(setting: str, value: object) -> None:
    given: dict[str, object] = {"threshold_m": 0.01, setting: value}
    with pytest.raises(DivespotError, match=f"{setting} is .* needed"):
        divespot.fit_plane(plane_with_strays((0, 0, 1))[:50], **given)  # type: ignore[arg-type]


@settings(max_examples=40, deadline=None)
@given(
    st.lists(
        st.tuples(*[st.floats(-1e3, 1e3, allow_subnormal=False)] * 3), min_size=3, max_size=30
    ),
    st.sampled_from([1e-3, 0.1, 50.0]),
)
def test_any_few_points_have_a_plane_with_inliers_or_an_error(
    points: list[tuple[float, float, float]], threshold_m: float
) -> None:
    try:
        plane = divespot.fit_plane(points, threshold_m, hypotheses=50)
    except DivespotError as error:
        assert "line" in str(error)  # noqa: PT017 - the only error there may be
    else:
        assert plane.inliers >= 3
        assert 0 <= plane.rms_m <= threshold_m * (1 + 1e-9)
        assert np.linalg.norm(plane.normal) == pytest.approx(1, abs=1e-12)
