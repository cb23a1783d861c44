"""Volume methods against closed forms, against each other, and on bad input."""

from __future__ import annotations

import sys
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

import divespot
from divespot import DivespotError
from divespot.volume import (
    METHODS,
    alpha_shape,
    bodies_of,
    hull,
    inner_voxels,
    slices,
    tin,
    volumes_m3,
)
from divespot.volume.body import inside
from solids import SOLIDS, STEP_M, raster, sampled

if TYPE_CHECKING:
    from collections.abc import Callable

    from divespot.volume.methods import Method

Floats = NDArray[np.float64]

BY_NAME: dict[str, Callable[[Floats], float]] = {
    "voxels": lambda points: inner_voxels(points, STEP_M),
    "slices": lambda points: slices(points, STEP_M),
    "hull": hull,
    "alpha": lambda points: alpha_shape(points, 0.5),
    "tin": tin,
}


def standing(name: str) -> Floats:
    points = sampled(SOLIDS[name])
    return points[points[:, 2] > 0]


@pytest.mark.parametrize(
    ("solid", "method", "within"),
    [
        ("cone", "voxels", 0.003),
        ("cone", "slices", 0.05),
        ("cone", "hull", 0.005),
        ("cone", "alpha", 0.005),
        ("cone", "tin", 0.005),
        ("hemisphere", "voxels", 0.002),
        ("hemisphere", "hull", 0.005),
        ("hemisphere", "alpha", 0.005),
        ("hemisphere", "tin", 0.005),
        ("box", "voxels", 1e-12),
    ],
)
def test_closed_forms(solid: str, method: str, within: float) -> None:
    assert BY_NAME[method](standing(solid)) == pytest.approx(SOLIDS[solid].volume_m3, rel=within)


@pytest.mark.parametrize("method", ["hull", "tin", "alpha"])
def test_a_box_ends_at_its_outermost_points(method: str) -> None:
    # Known weakness: half a cell short on each side.
    expected = (1 - STEP_M) * (0.5 - STEP_M) * 0.25
    assert BY_NAME[method](standing("box")) == pytest.approx(expected, rel=1e-3)


def test_thick_slices_give_too_much_and_thin_ones_too_little() -> None:
    cone, truth = standing("cone"), SOLIDS["cone"].volume_m3
    # One layer counts with the area of the foot, three with that of their lower edges.
    assert slices(cone, 0.26) == pytest.approx(0.26 * pi / 4, rel=0.02)
    assert slices(cone, 0.25 / 3) == pytest.approx(pi / 12 * (1 + 4 / 9 + 1 / 9) / 4, rel=0.03)
    assert slices(cone, 1e-5) < 0.5 * truth
    volumes = [slices(cone, thick) / truth for thick in (0.05, 0.1, 0.2)]
    assert volumes == sorted(volumes)


def test_a_concave_contour_follows_a_bay() -> None:
    x, y = raster(64, 64)
    corner = (x < 0) | (y < 0)
    bay = np.column_stack([x, y, np.full_like(x, 0.5)])[corner]
    full, part = slices(bay, 1.0), slices(bay, 1.0, contour="concave", reach_m=4 * STEP_M)
    assert full == pytest.approx(1 - 1 / 8, rel=0.03)
    assert part == pytest.approx(3 / 4, rel=0.03)


def test_a_concave_contour_holds_what_it_encloses() -> None:
    x, y = raster(64, 64)
    ring = np.column_stack([x, y, np.full_like(x, 0.5)])[np.maximum(abs(x), abs(y)) > 0.4]
    assert slices(ring, 1.0, contour="concave", reach_m=4 * STEP_M) == pytest.approx(1, rel=0.02)


def test_the_alpha_shape_grows_with_alpha_up_to_the_hull() -> None:
    heap = sampled(SOLIDS["cone"], 2**-5)
    heap = heap[heap[:, 2] > 0]
    heap = np.r_[heap, heap + np.array([1.25, 0, 0])]
    volumes = [alpha_shape(heap, alpha) for alpha in (0.001, 0.05, 0.1, 0.2, 1.0, 1e9)]
    assert volumes == sorted(volumes)
    truth = 2 * SOLIDS["cone"].volume_m3
    assert volumes[0] < 1e-6
    assert volumes[1] < 0.5 * truth
    assert volumes[-1] == pytest.approx(hull(heap), rel=2e-3)
    assert volumes[-1] > 1.3 * truth


def test_triangles_outside_the_outline_do_not_count() -> None:
    x, y = raster(64, 64)
    bay = np.column_stack([x, y, np.full_like(x, 0.5)])[(x < 0) | (y < 0)]
    outline = 0.5 * np.array([[-1, -1], [1, -1], [1, 0], [0, 0], [0, 1], [-1, 1]])
    assert tin(bay) > 1.1 * tin(bay, outline)
    assert tin(bay, outline) == pytest.approx(3 / 8, rel=0.03)


def test_below_the_base_triangles_count_as_missing() -> None:
    heap = standing("cone")
    assert tin(heap * [1, 1, -1]) == pytest.approx(-tin(heap))


@pytest.mark.parametrize("method", BY_NAME)
@pytest.mark.parametrize("points", [np.empty((0, 3)), np.ones((1, 3)), np.ones((9, 3))])
def test_what_spans_nothing_has_no_volume(method: str, points: Floats) -> None:
    expected = STEP_M**2 * 1.0 if method == "voxels" and len(points) else 0.0
    assert BY_NAME[method](points) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("method", BY_NAME)
@pytest.mark.parametrize("points", [np.ones(3), np.ones((4, 2)), np.full((5, 3), np.nan)])
def test_bad_points_are_refused(method: str, points: Floats) -> None:
    with pytest.raises(DivespotError, match=r"of shape \(n, 3\) are needed"):
        BY_NAME[method](points)


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf")])
def test_bad_lengths_are_refused(length: float) -> None:
    calls: dict[str, Callable[[Floats, float], float]] = {
        "voxel_m": inner_voxels,
        "slice_m": slices,
        "alpha_m": alpha_shape,
    }
    for name, call in calls.items():
        with pytest.raises(DivespotError, match=f"{name} is .*above 0 is needed"):
            call(standing("cone"), length)


def test_too_many_voxels_are_refused() -> None:
    with pytest.raises(DivespotError, match="a larger edge is needed"):
        inner_voxels(standing("cone"), 1e-6)


@pytest.mark.parametrize("method", ["slices", "hull", "alpha", "tin"])
def test_without_scipy_one_sentence_tells_the_extra(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "scipy.spatial", None)
    with pytest.raises(DivespotError, match=r"pip install divespot\[methods\]"):
        BY_NAME[method](standing("cone"))
    assert BY_NAME["voxels"](standing("cone")) > 0


def test_inside_is_even_odd() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    places = np.array([[0.5, 0.5], [1.5, 0.5], [-0.5, 0.5], [0.5, 1.5]])
    assert inside(places, square).tolist() == [True, False, False, False]
    assert inside(places, square[::-1]).tolist() == [True, False, False, False]


@pytest.mark.parametrize("method", METHODS)
def test_a_report_is_measured_by_a_method(method: Method) -> None:
    report = divespot.measure(sampled(SOLIDS["cone"], STEP_M))
    (volume_m3,) = volumes_m3(report, method)
    within = 0.05 if method == "slices" else 0.01
    assert volume_m3 == pytest.approx(SOLIDS["cone"].volume_m3, rel=within)
    assert volume_m3 != report.piles[0].volume_m3


def test_the_parameters_follow_from_the_scan() -> None:
    report = divespot.measure(sampled(SOLIDS["cone"]))
    (body,) = bodies_of(report)
    cell_m, highest_m = body.cell_m, report.piles[0].max_height_m
    given: list[tuple[Method, dict[str, Any]]] = [
        ("voxels", {"voxel_m": cell_m}),
        ("slices", {"slice_m": 0.25 * cell_m, "contour": "convex"}),
        ("alpha", {"alpha_m": highest_m}),
    ]
    for method, own in given:
        assert volumes_m3(report, method) == volumes_m3(report, method, **own)
    assert volumes_m3(report, "alpha", alpha_m=0.01) != volumes_m3(report, "alpha")


def test_an_unknown_method_is_refused() -> None:
    report = divespot.measure(sampled(SOLIDS["cone"]))
    with pytest.raises(DivespotError, match=r"method is 'mesh': one of voxels, .* is needed"):
        volumes_m3(report, "mesh")  # type: ignore[arg-type]
