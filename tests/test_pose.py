"""The rotation that lays a plane level."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import divespot
from divespot import DivespotError
from divespot.simulate import Pose

if TYPE_CHECKING:
    from slow import Floats

NORMALS = [
    (0.0, 0.0, 1.0),
    (0.0, 0.0, -1.0),
    (0.0, 0.0, -3e5),
    (1.0, 0.0, 0.0),
    (0.0, -2.0, 0.0),
    (1e-9, 0.0, 1.0),
    (1e-9, -1e-9, -1.0),
    (1e-17, 0.0, -1.0),
]


def check(normal: Floats) -> None:
    rotation = divespot.rotation_to_z(normal.tolist())
    unit = normal / np.abs(normal).max()
    unit /= np.linalg.norm(unit)
    np.testing.assert_allclose(rotation @ unit, [0, 0, 1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), rtol=0, atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1, abs=1e-12)
    # The shortest way turns by the angle between the two, no further.
    assert (np.trace(rotation) - 1) / 2 == pytest.approx(unit[2], abs=1e-12)


@pytest.mark.parametrize("normal", NORMALS)
def test_named_normals_go_onto_z_by_the_shortest_way(normal: tuple[float, float, float]) -> None:
    check(np.array(normal))


@given(st.tuples(*[st.floats(-1e6, 1e6)] * 3).filter(lambda n: max(map(abs, n)) > 1e-6))
def test_any_normal_goes_onto_z_by_the_shortest_way(normal: tuple[float, float, float]) -> None:
    check(np.array(normal))


def test_the_axis_lies_in_the_plane_of_the_floor() -> None:
    # Not along z, as the paper's formula prints it: what is across both stays where it is.
    rotation = divespot.rotation_to_z((0.6, 0.0, 0.8))
    np.testing.assert_allclose(rotation @ [0, 1, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(rotation @ [0.8, 0, -0.6], [1, 0, 0], atol=1e-15)


@pytest.mark.parametrize(
    "normal",
    [(0, 0, 0), (float("nan"), 0, 1), (float("inf"), 0, 1), (1, 2), (1, 2, 3, 4), "z", None, 5],
)
def test_no_direction_is_refused(normal: object) -> None:
    with pytest.raises(DivespotError, match="need"):
        divespot.rotation_to_z(normal)  # type: ignore[arg-type]


@pytest.mark.parametrize("tilt", [(0, 0), (30, 0), (0, -60), (90, 45), (180, 0), (120, 200)])
def test_a_fitted_plane_comes_to_lie_level(tilt: tuple[float, float]) -> None:
    rng = np.random.default_rng(2)
    floor = np.c_[rng.uniform(-1, 1, (500, 2)), np.full(500, 0.25)]
    turn = Pose(*tilt, 33.0, (0.0, 0.0, 0.0)).matrix()[:3, :3]
    points = floor @ turn.T
    plane = divespot.fit_plane(points, 0.01)
    level = points @ divespot.rotation_to_z(plane.normal).T
    np.testing.assert_allclose(level[:, 2], plane.offset_m, atol=1e-9)
