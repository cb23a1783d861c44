"""From depth frames to a scan: poses, heights and volumes against the simulation's truth."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import DivespotError, _native, simulate
from divespot.frames import fuse
from divespot.frames.intrinsics import Intrinsics
from divespot.frames.placing import View, place
from divespot.frames.source import Frames
from divespot.simulate import scene_named

if TYPE_CHECKING:
    from divespot.io import Scan
    from divespot.simulate import SimulatedFrames

DENSITY = 0.12
SHAPE = scene_named("shape-05", 0)
ALONE = replace(SHAPE, things=())


def position_errors_m(scan: Scan, taken: SimulatedFrames) -> np.ndarray:
    """Return how far cameras are off, turned and moved onto the truth as a whole."""
    assert scan.registration is not None
    found = np.array([pose for pose in scan.registration.poses if pose is not None])
    true = taken.poses[[pose is not None for pose in scan.registration.poses]]
    u, _, v = np.linalg.svd(np.einsum("nij,nkj->ik", true[:, :3, :3], found[:, :3, :3]))
    at = found[:, :3, 3] @ (u @ v).T
    off = (at - at.mean(axis=0)) - (true[:, :3, 3] - true[:, :3, 3].mean(axis=0))
    return np.asarray(np.linalg.norm(off, axis=1))


@pytest.fixture(scope="module")
def rail() -> SimulatedFrames:
    return simulate.frames(SHAPE, density=DENSITY)


@pytest.fixture(scope="module")
def fused(rail: SimulatedFrames) -> Scan:
    return fuse(rail.depth, rail.matrix)


def test_frames_from_a_rail_give_the_pile_and_where_the_camera_was(
    rail: SimulatedFrames, fused: Scan
) -> None:
    found = fused.registration
    assert found is not None
    assert found.frames == 4
    assert not found.is_still
    assert position_errors_m(fused, rail).max() < 0.002
    # The camera measures 4 mm too long, and each frame has an error of its own.
    assert abs(found.offset_m + 0.004) < 3 * found.u_offset_m
    report = divespot.measure(fused)
    (pile,) = report.piles
    assert abs(pile.volume_m3 / rail.volume_m3 - 1) < 0.01
    assert abs(pile.volume_m3 - rail.volume_m3) < pile.u95_m3
    assert report.ground.up_from in {"sensor", "small tilt"}


def test_the_floor_is_level_and_at_zero(fused: Scan) -> None:
    z = fused.points[np.abs(fused.points[:, 2]) < 0.02, 2]
    assert abs(np.median(z)) < 1e-3
    assert fused.viewpoint_m is not None
    assert abs(fused.viewpoint_m[2] - 1.414) < 0.005
    assert fused.sensors_m is not None
    assert fused.sensors_m.shape == (4, 3)


def test_the_same_bits_at_any_number_of_threads(rail: SimulatedFrames, fused: Scan) -> None:
    other = fuse(rail.depth, rail.matrix, threads=1)
    assert other.points.tobytes() == fused.points.tobytes()
    three = fuse(rail.depth, rail.matrix, threads=3)
    assert three.points.tobytes() == fused.points.tobytes()


def test_the_budget_has_what_the_frames_differ_by(fused: Scan) -> None:
    found = fused.registration
    assert found is not None
    (pile,) = divespot.measure(fused).piles
    places = max(1.0, pile.footprint_m2 / found.place_m**2)
    u_height_m = np.hypot(found.u_height_m, found.u_place_m / np.sqrt(places))
    expected = np.hypot(pile.footprint_m2 * u_height_m, found.u_scale * pile.volume_m3)
    assert pile.budget.registration_m3 == pytest.approx(expected)
    without = replace(fused, registration=None)
    (assumed,) = divespot.measure(without).piles
    assert assumed.volume_m3 == pile.volume_m3
    assert assumed.budget.registration_m3 != pile.budget.registration_m3
    assert pile.budget.footprint_m3 < 0.2 * assumed.budget.footprint_m3


def test_u95_holds_the_truth_and_is_no_wider_than_a_camera_of_unknown_scale_needs() -> None:
    # `benches/frames_coverage.py` does so many times, and finds 95 % held.
    for number, name in enumerate(("shape-05", "shape-11", "shape-14")):
        taken = simulate.frames(name, seed=number, density=0.06)
        scale = 1.0 + 0.0005 * (number - 1)
        depth = (taken.depth * (0.001 * scale)).astype(np.float32)
        (pile, *_) = divespot.measure(fuse(depth, taken.matrix)).piles
        assert abs(pile.volume_m3 - taken.volume_m3) < pile.u95_m3
        assert pile.u95_m3 < 0.006 * taken.volume_m3, name


def test_exact_poses_are_kept_and_rough_ones_improved(rail: SimulatedFrames) -> None:
    kept = fuse(rail.depth, rail.matrix, rail.poses, exact_poses=True)
    assert kept.registration is not None
    poses = np.array([pose for pose in kept.registration.poses if pose is not None])
    assert np.abs(poses - rail.poses).max() < 1e-5
    rough = rail.poses.copy()
    rough[:, :3, 3] += np.random.default_rng(0).normal(0, 0.02, (4, 3))
    assert position_errors_m(fuse(rail.depth, rail.matrix, rough), rail).max() < 0.002


def test_a_shaking_hand(request: pytest.FixtureRequest) -> None:
    taken = simulate.frames(ALONE, path="hand", count=8, density=0.06)
    scan = fuse(taken.depth, taken.matrix)
    assert position_errors_m(scan, taken).max() < 0.003
    assert scan.registration is not None
    assert scan.registration.loops > 3, request.node.name


def test_frames_that_were_not_solved_for_are_laid_between_the_others() -> None:
    taken = simulate.frames(ALONE, count=70, density=0.02)
    scan = fuse(taken.depth, taken.matrix)
    assert scan.registration is not None
    assert scan.registration.frames == 70
    assert position_errors_m(scan, taken).max() < 0.008


def test_a_hand_over_a_pile_is_not_told_that_it_slides() -> None:
    taken = simulate.frames(ALONE, path="hand", count=8, density=0.06)
    assert fuse(taken.depth, taken.matrix).warnings == ()


def test_poses_of_another_sequence_make_no_second_pile(rail: SimulatedFrames) -> None:
    scan = fuse(rail.depth, rail.matrix, rail.poses[[3, 1, 0, 2]])
    (pile,) = divespot.measure(scan).piles
    assert abs(pile.volume_m3 / rail.volume_m3 - 1.0) < 0.01


def test_a_range_that_no_depth_camera_has_is_said(rail: SimulatedFrames) -> None:
    tenths = np.minimum(rail.depth.astype(np.uint32) * 10, 65_534).astype(np.uint16)
    assert any("depth_scale" in w for w in fuse(tenths, rail.matrix).warnings)
    assert fuse(tenths, rail.matrix, depth_scale=1e-4).warnings == ()


def test_intrinsics_of_another_image_size_are_doubted(rail: SimulatedFrames) -> None:
    doubled = rail.matrix * np.array([[2.0], [2.0], [1.0]])
    assert any("another size" in w for w in fuse(rail.depth, doubled).warnings)


def test_a_fixed_camera_is_averaged_and_a_walker_leaves_no_trace() -> None:
    taken = simulate.frames(SHAPE, path="fixed", count=15, density=0.06)
    scan = fuse(taken.depth, taken.matrix)
    assert scan.registration is not None
    assert scan.registration.is_still
    assert "15 frames were averaged" in scan.warnings[-1]
    walked = divespot.measure(scan).piles[0]
    still = simulate.frames(replace(SHAPE, things=()), path="fixed", count=15, density=0.06)
    empty = replace(still, depth=still.depth[:4])  # nobody walks before a third of the frames
    alone = divespot.measure(fuse(empty.depth, empty.matrix)).piles[0]
    assert abs(walked.volume_m3 - alone.volume_m3) < walked.u95_m3
    assert abs(walked.volume_m3 - taken.volume_m3) < walked.u95_m3


def test_a_bare_floor_tells_nothing_of_the_way_along_it_and_that_is_said() -> None:
    bare = replace(SHAPE, things=(), piles=())
    taken = simulate.frames(bare, density=0.06)
    said = " ".join(fuse(taken.depth, taken.matrix).warnings)
    assert "nothing in view shows how far the camera moved" in said or "stood still" in said


def test_a_frame_that_fits_nowhere_is_left_out_and_named(rail: SimulatedFrames) -> None:
    other = simulate.frames(scene_named("shape-16", 3), density=DENSITY, count=1)
    depth = np.concatenate([rail.depth[:3], other.depth[:, ::-1] // 2, rail.depth[3:]])
    scan = fuse(depth, rail.matrix)
    assert scan.registration is not None
    assert scan.registration.left_out == ("frame 4",)
    assert any(w.startswith("frame 4: left out: it ") for w in scan.warnings)
    assert scan.registration.frames == 4


def test_frames_far_apart_are_doubted() -> None:
    taken = simulate.frames("shape-17", density=0.1)
    assert fuse(taken.depth, taken.matrix).warnings == ()
    said = fuse(taken.depth[[0, -1]], taken.matrix).warnings
    assert any("overlap of 70 %" in w or "left out" in w for w in said)


def test_an_empty_frame_is_left_out_and_only_empty_ones_refused(rail: SimulatedFrames) -> None:
    empty = np.zeros_like(rail.depth[:1])
    scan = fuse(np.concatenate([rail.depth, empty]), rail.matrix)
    assert scan.registration is not None
    assert scan.registration.left_out == ("frame 5",)
    with pytest.raises(DivespotError, match="frame 1: it shows too little"):
        fuse(empty, rail.matrix)


def test_radial_depth_and_metres_give_what_planar_depth_does(rail: SimulatedFrames) -> None:
    rows, columns = rail.depth.shape[1:]
    along = Intrinsics.of(rail.matrix).rays(rows, columns)[:, 2].reshape(rows, columns)
    radial = (rail.depth[:2] * 0.001 / along).astype(np.float32)
    one = fuse(radial, rail.matrix, depth_kind="radial")
    other = fuse(rail.depth[:2], rail.matrix)
    # A pixel on the face between two voxels may fall into the other.
    assert len(one.points) == pytest.approx(len(other.points), rel=1e-3)
    assert one.registration is not None
    assert other.registration is not None
    for a, b in zip(one.registration.poses, other.registration.poses, strict=True):
        assert a is not None
        assert b is not None
        assert np.abs(a - b).max() < 1e-4


def test_frames_merge_in_any_order_to_the_same_bits(rail: SimulatedFrames) -> None:
    view = View.of(Frames.of(rail.depth), Intrinsics.of(rail.matrix), "planar", 1)
    joint = place(view).solve()

    def fusion(numbers: list[int]) -> _native.RawFusion:
        found: _native.RawFusion = view.fusion(joint, 0.01, 1.0)
        for n in numbers:
            pose = joint.poses[n]
            assert pose is not None
            found.add(*view.frame(n), pose, joint.offsets_m[n])
        return found

    whole = fusion([0, 1, 2, 3]).points()
    parts = fusion([3, 1])
    parts.merge(fusion([2, 0]))
    merged = parts.points()
    assert [a.tobytes() for a in whole] == [a.tobytes() for a in merged]


@pytest.mark.parametrize(
    ("depth", "more", "words"),
    [
        (np.zeros((2, 2), np.uint16), {}, "3 x 3"),
        (np.zeros(5), {}, "shape"),
        (np.zeros((3, 4, 4), complex), {}, "complex"),
        (np.ones((1, 9, 9)), {"depth_kind": "round"}, "planar or radial"),
        (np.ones((1, 9, 9)), {"depth_scale": -1.0}, "depth_scale is -1.0"),
        (np.ones((1, 9, 9)), {"exact_poses": True}, "poses are needed with it"),
        (np.ones((1, 9, 9)), {"poses": np.eye(4)}, r"shape \(4, 4\)"),
        (np.ones((2, 9, 9)), {"poses": np.eye(4)[None]}, "1 poses for 2 frames"),
        (np.ones((1, 9, 9)), {"poses": np.ones((1, 4, 4))}, "no rigid motion"),
        (np.ones((1, 9, 9)), {"voxel_m": -1.0}, "voxel_m is -1"),
    ],
)
def test_bad_frames_are_refused(
    depth: np.ndarray, more: dict[str, object], words: str, rail: SimulatedFrames
) -> None:
    if "voxel_m" in more:
        depth = rail.depth[:1]
    matrix = rail.matrix
    with pytest.raises(DivespotError, match=words):
        fuse(depth, matrix, **more)  # type: ignore[arg-type]
