"""The simulated scans' truth, against independent sums, statistics and geometry."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from divespot.errors import DivespotError
from divespot.simulate import (
    FLYING,
    INVALID,
    NAMES,
    STRAY,
    THING,
    Box,
    Camera,
    Floor,
    Person,
    Pile,
    Pose,
    Rod,
    Scene,
    SimulatedScan,
    Wall,
    scan,
    scene_named,
)
from divespot.simulate.families import FAMILIES
from divespot.simulate.terrain import terrain

QUIET = Camera(
    frames=1,
    pixels=(180, 200),
    noise_m=0.0,
    bias_m=0.0,
    frame_bias_m=0.0,
    shift_m=0.0,
    turn_deg=0.0,
    flying_share=0.0,
    stray_share=0.0,
)
FLOOR = Floor(2.6, 2.6, node_m=0.008)
TINY = Scene(FLOOR, (Pile(0.02),), (), QUIET, fuse_voxel_m=0.0)


def quadrature(taken: SimulatedScan, pile: int, per_cell: int = 2) -> float:
    """Volume by Gauss points in each cell, from public heights alone: exact for bilinear."""
    surface = taken.surface
    own = np.where(surface.owner == pile, surface.height_m, 0.0)
    place, weight = np.polynomial.legendre.leggauss(per_cell)
    total = 0.0
    for u, wu in zip((place + 1) / 2, weight / 2, strict=True):
        for v, wv in zip((place + 1) / 2, weight / 2, strict=True):
            low = own[:-1, :-1] * (1 - u) + own[:-1, 1:] * u
            high = own[1:, :-1] * (1 - u) + own[1:, 1:] * u
            total += wu * wv * float(np.sum(low * (1 - v) + high * v))
    return total * surface.node_m**2


@pytest.mark.parametrize(
    "floor",
    [
        FLOOR,
        replace(FLOOR, wave_m=0.006),
        replace(FLOOR, fold_deg=3.0, edge_m=0.05),
        replace(FLOOR, step_m=0.03, edge_m=0.05),
        replace(FLOOR, slope_deg=2.0),
    ],
)
@pytest.mark.parametrize(
    "pile",
    [
        Pile(0.02),
        Pile(0.014, (0.1, -0.1), ridge=0.6),
        Pile(0.03, repose_deg=35, peaks=4, roughness_m=0.003),
    ],
)
def test_volume_is_the_integral_of_the_surface(floor: Floor, pile: Pile) -> None:
    taken = scan(replace(TINY, floor=floor, piles=(pile,)), seed=3)
    assert taken.volume_m3 == pytest.approx(pile.volume_m3, rel=1e-12)
    assert quadrature(taken, 1) == pytest.approx(pile.volume_m3, rel=1e-9)


def test_volume_is_that_of_the_surface_seen() -> None:
    # Random places in plan: an integral that knows nothing of nodes or weights.
    taken = scan(replace(TINY, floor=replace(FLOOR, fold_deg=3.0)))
    bare = scan(replace(TINY, floor=replace(FLOOR, fold_deg=3.0), piles=()))
    steps = (np.arange(1500) + 0.5) / 1500 - 0.5
    x, y = (side.ravel() for side in np.meshgrid(steps * 1.2, steps * 1.2))
    mean_m = float(np.mean(taken.surface.z(x, y) - bare.surface.z(x, y)))
    assert mean_m * 1.2**2 == pytest.approx(taken.volume_m3, rel=1e-6)


@pytest.mark.parametrize(("peaks", "ridge"), [(1, 0.0), (1, 0.7), (4, 0.0), (3, 0.4)])
def test_no_flank_is_steeper_than_the_angle_of_repose(peaks: int, ridge: float) -> None:
    pile = Pile(0.03, repose_deg=30, peaks=peaks, ridge=ridge, roughness_m=0.0)
    for seed in range(5):
        height_m = scan(replace(TINY, piles=(pile,)), seed=seed).surface.height_m
        limit_m = math.tan(math.radians(30)) * FLOOR.node_m * (1 + 1e-5)
        assert np.abs(np.diff(height_m, axis=0)).max() < limit_m
        assert np.abs(np.diff(height_m, axis=1)).max() < limit_m
        assert np.abs(height_m[1:, 1:] - height_m[:-1, :-1]).max() < limit_m * math.sqrt(2)
        slope = np.hypot(*np.gradient(height_m, FLOOR.node_m))
        assert np.median(slope[slope > 0]) > math.tan(math.radians(20))


def test_a_cone_has_the_height_and_width_of_its_angle() -> None:
    surface, _ = terrain(replace(TINY, piles=(Pile(0.02, repose_deg=30, roughness_m=0.0),)), 1)
    height_m = surface.height_m.max()
    slope = math.tan(math.radians(30))
    width_m = 2 * math.sqrt(np.count_nonzero(surface.height_m) / math.pi) * FLOOR.node_m
    ideal_m = (3 * 0.02 / (math.pi * slope)) ** (1 / 3)
    assert 0.75 < height_m / (ideal_m * slope) < 1.02
    assert 0.98 < width_m / (2 * ideal_m) < 1.15


def test_roughness_is_as_asked_and_leaves_the_floor_alone() -> None:
    rough = replace(TINY, piles=(Pile(0.2, roughness_m=0.002, grain_m=0.03),))
    smooth = replace(TINY, piles=(Pile(0.2, roughness_m=0.0),))
    (one, _), (other, _) = terrain(rough, 1), terrain(smooth, 1)
    difference_m = (one.height_m - other.height_m)[other.height_m > 0.03]
    assert np.std(difference_m) == pytest.approx(0.002, rel=0.15)
    bare = other.height_m == 0
    assert np.all(one.height_m[bare] < 0.002)


def test_touching_piles_share_the_valley() -> None:
    piles = (Pile(0.02, (-0.25, 0)), Pile(0.015, (0.25, 0)))
    taken = scan(replace(TINY, piles=piles))
    for number, (volume_m3, pile) in enumerate(zip(taken.volumes_m3, piles, strict=True), start=1):
        assert 0.9 * pile.volume_m3 < volume_m3 < pile.volume_m3
        assert quadrature(taken, number) == pytest.approx(volume_m3, rel=1e-9)
    assert taken.volume_m3 == sum(taken.volumes_m3)


@pytest.mark.parametrize("face_m", [0.2, 0.2013, 0.2077])
def test_a_wall_cuts_the_pile_and_the_truth(face_m: float) -> None:
    y = face_m + 0.05
    wall = Wall((-1.2, y), (1.2, y), leaned_on=True)
    pile = Pile(0.02, (0.0, face_m - 1e-4), roughness_m=0.0)
    taken = scan(replace(TINY, piles=(pile,), things=(wall,)))
    surface = taken.surface
    # A fine sum up to the face, which lies on a node or between two.
    fine = np.linspace(surface.y[0], face_m, 20001)
    middles = (fine[1:] + fine[:-1]) / 2
    columns = [surface.z(np.full_like(middles, x), middles).mean() for x in surface.x]
    volume_m3 = sum(columns) * surface.node_m * (face_m - surface.y[0])
    assert taken.volume_m3 == pytest.approx(0.02, rel=1e-12)
    assert volume_m3 == pytest.approx(0.02, rel=1e-6)
    assert np.all(taken.points[taken.labels == 1, 1] <= face_m + 1e-6)


@pytest.mark.parametrize("pitch_deg", [0.0, 25.0, 60.0])
def test_noiseless_points_lie_on_the_surface(pitch_deg: float) -> None:
    camera = replace(QUIET, pitch_deg=pitch_deg, offset_m=-0.8)
    taken = scan(replace(TINY, camera=camera, floor=replace(FLOOR, step_m=0.03)))
    points = taken.points
    assert len(points) > 3000
    np.testing.assert_allclose(
        points[:, 2], taken.surface.z(points[:, 0], points[:, 1]), rtol=0, atol=1e-6
    )


def test_nothing_hidden_is_seen_and_nothing_seen_is_missed() -> None:
    # Against a slow walk along each line of sight in steps far below a node.
    camera = replace(QUIET, pixels=(14, 40), pitch_deg=62.0, offset_m=-1.3, height_m=0.7)
    taken = scan(replace(TINY, camera=camera))
    lens = np.array([0.0, -1.3, 0.7])
    for point in taken.points:
        path = lens + np.linspace(0, 1, 4000)[:-2, None] * (point - lens)
        above = path[:, 2] - taken.surface.z(path[:, 0], path[:, 1])
        assert above.min() > -1e-5


def test_the_far_flank_is_hidden_from_one_side() -> None:
    scene = replace(TINY, camera=replace(QUIET, pitch_deg=65, offset_m=-1.6, height_m=0.5))
    points = scan(scene).points
    column = points[np.abs(points[:, 0]) < 0.05]
    foot_m = (3 * 0.02 / (math.pi * math.tan(math.radians(23)))) ** (1 / 3)
    assert np.any((column[:, 1] > -foot_m) & (column[:, 1] < -0.5 * foot_m))
    assert not np.any((column[:, 1] > 0.1 * foot_m) & (column[:, 1] < foot_m))


def test_camera_sees_floor_to_its_edges() -> None:
    # A floor that ended in sight would leave pixels without a return.
    for name in ("shape-01", "shape-12", "shape-17", "three-piles"):
        scene = replace(scene_named(name), fuse_voxel_m=0.0, things=())
        quiet = replace(scene.camera, pixels=(30, 30), stray_share=0.0)
        taken = scan(replace(scene, camera=quiet))
        assert len(taken.points) == 900 * scene.camera.frames


def test_things_are_met_in_closed_form() -> None:
    box = Box((0.3, 0.1), (0.2, 0.3, 0.25), 30.0)
    rod = Rod((-0.3, 0.2), 0.05, 0.4)
    camera = replace(QUIET, pitch_deg=20.0, offset_m=-0.5)
    taken = scan(replace(TINY, piles=(), things=(box, rod), camera=camera))
    points = taken.points[taken.labels == THING]
    turn = np.radians(30.0)
    own = points - [0.3, 0.1, 0.0]
    along = own[:, 0] * np.cos(turn) + own[:, 1] * np.sin(turn)
    across = own[:, 1] * np.cos(turn) - own[:, 0] * np.sin(turn)
    from_box = np.max([np.abs(along) - 0.1, np.abs(across) - 0.15, own[:, 2] - 0.25], axis=0)
    radial = np.hypot(points[:, 0] + 0.3, points[:, 1] - 0.2) - 0.05
    from_rod = np.maximum(radial, points[:, 2] - 0.4)
    assert np.count_nonzero(np.abs(from_box) < 1e-9) > 100
    assert np.count_nonzero(np.abs(from_rod) < 1e-9) > 100
    assert np.all(np.minimum(np.abs(from_box), np.abs(from_rod)) < 1e-9)


def test_a_person_is_in_some_frames_only() -> None:
    person = Person((-0.2, 0.7), (0.3, 0.0), frames=(1, 2))
    camera = replace(QUIET, frames=4, pixels=(60, 60))
    scene = replace(TINY, things=(person,), camera=camera)
    there = scan(scene).points[scan(scene).labels == THING]
    assert there[:, 0].min() < -0.1
    assert there[:, 0].max() > 0.1
    nowhere = scan(replace(scene, things=(replace(person, frames=()),)))
    assert not np.any(nowhere.labels == THING)


@pytest.mark.parametrize("height_m", [0.7, 1.4, 2.8])
def test_noise_along_the_ray_grows_as_asked(height_m: float) -> None:
    camera = replace(QUIET, noise_m=0.0008, height_m=height_m, fov_deg=(20.0, 20.0))
    heights_m = scan(replace(TINY, piles=(), camera=camera), seed=2).points[:, 2]
    assert np.std(heights_m) == pytest.approx(0.0008 * height_m**2, rel=0.03)
    capped = replace(camera, noise_max_m=0.0002)
    heights_m = scan(replace(TINY, piles=(), camera=capped), seed=2).points[:, 2]
    assert np.std(heights_m) == pytest.approx(0.0002, rel=0.03)


def test_bias_and_registration_move_whole_frames() -> None:
    camera = replace(QUIET, frames=40, pixels=(20, 20), fov_deg=(4.0, 4.0), shift_m=0.001)
    scene = replace(TINY, piles=(), camera=replace(camera, bias_m=0.004, frame_bias_m=0.002))
    taken = scan(scene, seed=5)
    frames = taken.points[:, 2].reshape(40, -1)
    assert np.ptp(frames, axis=1).max() < 2e-5
    assert frames.mean() == pytest.approx(-0.004, abs=0.0015)
    assert frames[:, 0].std() == pytest.approx(math.hypot(0.001, 0.002), rel=0.35)


def test_flying_pixels_lie_between_edge_and_background() -> None:
    box = Box((0.2, 0.1), (0.2, 0.3, 0.25), 30.0)
    camera = replace(QUIET, flying_share=0.5)
    taken = scan(replace(TINY, piles=(), things=(box,), camera=camera))
    flying = taken.points[taken.labels == FLYING]
    assert len(flying) > 30
    assert np.all((flying[:, 2] > -0.003) & (flying[:, 2] < 0.253))
    assert np.count_nonzero((flying[:, 2] > 0.02) & (flying[:, 2] < 0.23)) > len(flying) / 2


def test_strays_and_invalid_points_come_in_the_shares_asked() -> None:
    camera = replace(QUIET, stray_share=0.08, zero_share=0.05, nan_share=0.02)
    taken = scan(replace(TINY, camera=camera, pose=Pose(shift_m=(1.0, 2.0, 3.0))))
    total = len(taken.points)
    valid = taken.labels != INVALID
    zero = np.all(taken.points == 0, axis=1)
    assert np.count_nonzero(taken.labels == STRAY) / np.count_nonzero(valid) == pytest.approx(
        0.08, abs=1e-3
    )
    assert np.count_nonzero(zero) / total == pytest.approx(0.05, abs=1e-3)
    assert np.count_nonzero(np.isnan(taken.points[:, 0])) / total == pytest.approx(0.02, abs=1e-3)


def test_one_seed_decides_every_bit() -> None:
    scene = replace(TINY, camera=Camera(frames=2, pixels=(60, 60)), fuse_voxel_m=0.01)
    one, same, other = scan(scene, seed=1), scan(scene, seed=1), scan(scene, seed=2)
    assert one.points.tobytes() == same.points.tobytes()
    assert one.labels.tobytes() == same.labels.tobytes()
    assert not np.array_equal(one.surface.height_m, other.surface.height_m)


def test_a_repeat_keeps_the_pile_and_renews_the_noise() -> None:
    scene = replace(TINY, camera=Camera(frames=2, pixels=(60, 60)), fuse_voxel_m=0.0)
    one, again = scan(scene, seed=1), scan(scene, seed=1, repeat=1)
    np.testing.assert_array_equal(one.surface.height_m, again.surface.height_m)
    assert not np.array_equal(one.points[:100], again.points[:100])


def test_changing_one_part_leaves_the_draws_of_the_others() -> None:
    noisy = replace(TINY, camera=replace(QUIET, stray_share=0.05, shift_m=0.001))
    one, other = scan(TINY), scan(noisy)
    np.testing.assert_array_equal(one.surface.height_m, other.surface.height_m)


@pytest.mark.parametrize("unit_m", [1.0, 0.001, 0.3048])
def test_the_pose_is_rigid_and_known(unit_m: float) -> None:
    pose = Pose(170.0, -20.0, 75.0, (482310.0, 5456790.0, 312.0))
    plain, moved = scan(TINY), scan(replace(TINY, pose=pose, unit_m=unit_m))
    np.testing.assert_allclose(moved.pose[:3, :3] @ moved.pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(moved.pose[:3, :3]) == pytest.approx(1)
    np.testing.assert_allclose(moved.in_scene(), plain.points, rtol=0, atol=1e-6)
    np.testing.assert_allclose(moved.up, moved.pose[:3, :3] @ [0, 0, 1])
    assert moved.volumes_m3 == plain.volumes_m3


def test_fusing_keeps_the_mean_and_thins_the_points() -> None:
    camera = replace(QUIET, frames=3, noise_m=0.001)
    raw = scan(replace(TINY, piles=(), camera=camera))
    fused = scan(replace(TINY, piles=(), camera=camera, fuse_voxel_m=0.02))
    cubes = {tuple(cube) for cube in np.floor(raw.points / 0.02).astype(int).tolist()}
    assert len(fused.points) == len(cubes)
    again = {tuple(cube) for cube in np.floor(fused.points / 0.02).astype(int).tolist()}
    assert again == cubes


@pytest.mark.parametrize("seed", [0, 1])
def test_a_dense_scan_from_above_rasterises_to_the_truth(seed: int) -> None:
    camera = replace(QUIET, height_m=8.0, fov_deg=(9.0, 9.0), pixels=(500, 500), range_m=(1, 10))
    taken = scan(replace(TINY, camera=camera, piles=(Pile(0.02, peaks=3),)), seed=seed)
    cell_m = 0.01
    cells = np.floor(taken.points[:, :2] / cell_m).astype(int)
    cells -= cells.min(axis=0)
    flat = cells[:, 0] * (cells[:, 1].max() + 1) + cells[:, 1]
    counts = np.bincount(flat)
    sums = np.bincount(flat, weights=taken.points[:, 2])
    volume_m3 = float(np.sum(sums[counts > 0] / counts[counts > 0])) * cell_m**2
    assert volume_m3 == pytest.approx(taken.volume_m3, rel=5e-3)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Pile(-1.0), "volume_m3 is -1.0"),
        (lambda: Pile(math.nan), "volume_m3 is nan"),
        (lambda: Pile(1.0, repose_deg=80), "repose_deg is 80"),
        (lambda: Pile(1.0, peaks=0), "peaks is 0"),
        (lambda: Floor(node_m=0.0), "node_m is 0.0"),
        (lambda: Floor(1000.0, 1000.0), "a larger Floor.node_m"),
        (lambda: Floor(fold_deg=60.0), "fold_deg is 60.0"),
        (lambda: Wall((0, 0), (0, 0)), "two points are needed"),
        (lambda: Wall((0, 0), (1, 1), leaned_on=True), "askew"),
        (lambda: Box((0, 0), (1.0, 0.0, 1.0)), "three numbers above 0"),
        (lambda: Camera(frames=0), "frames is 0"),
        (lambda: Camera(stray_share=1.0), "stray_share is 1.0"),
        (lambda: Camera(zero_share=0.6, nan_share=0.6), "a sum below 1 is needed"),
        (lambda: Camera(range_m=(2.0, 1.0)), "nearest before farthest"),
        (lambda: Scene(unit_m=0.0), "unit_m is 0.0"),
        (lambda: scan(replace(TINY, piles=(Pile(3.0),))), "beyond the floor"),
        (lambda: scan(replace(TINY, piles=(Pile(0.02, (9.0, 0.0)),))), "place on the floor"),
        (lambda: scan(replace(TINY, strip_m=(0.5, 0.5))), "beyond the strip"),
        (lambda: scan(replace(TINY, things=(Rod((0.1, 0.0)),))), "reaches into"),
        (
            lambda: scan(replace(TINY, things=(Wall((-0.1, 0.2), (0.1, 0.2), leaned_on=True),))),
            "longer wall",
        ),
        (lambda: scan(replace(TINY, camera=replace(QUIET, height_m=0.01))), "under the surface"),
        (lambda: scan(TINY, seed=-1), "seed is -1"),
        (lambda: scan(TINY, density=0.0), "density is 0.0"),
        (lambda: scan("shape-99"), "shape-01, shape-02, "),
    ],
)
def test_bad_input_is_named(make: object, sentence: str) -> None:
    assert callable(make)
    with pytest.raises(DivespotError, match=sentence):
        make()


def test_every_name_is_a_scene_of_its_own() -> None:
    assert len(NAMES) == 34 + len(FAMILIES)
    shapes = [scene_named(f"shape-{i:02d}") for i in range(1, 19)]
    volumes = [shape.piles[0].volume_m3 for shape in shapes]
    assert (
        volumes == [0.014] * 3 + [0.028] * 3 + [0.035] * 3 + [0.028] * 3 + [0.035] * 3 + [0.335] * 3
    )
    areas = [math.prod(shape.strip_m) for shape in shapes if shape.strip_m]
    np.testing.assert_allclose(areas, [1.3] * 9 + [2.6] * 6 + [5.2] * 3, rtol=0.01)
