"""Voxel downsampling."""

import numpy as np
import pytest

import divespot
import slow
from cases import CASES, scattered
from divespot import DivespotError


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("voxel_m", [1e-4, 0.03, 0.25, 100.0])
def test_means_and_counts_are_those_of_the_definition(name: str, voxel_m: float) -> None:
    points = CASES[name]
    means, counts = divespot.voxel_downsample(points, voxel_m, return_counts=True)
    expected, expected_counts = slow.voxel_downsample(points, voxel_m)
    finite = np.isfinite(points).all(axis=1)
    origin = points[finite].min(axis=0).astype(float) if finite.any() else np.zeros(3)
    assert counts.tolist() == expected_counts
    np.testing.assert_allclose(means - origin, expected, rtol=0, atol=1e-9 * max(voxel_m, 2))


def test_a_shuffled_cloud_gives_the_same_bits() -> None:
    points = scattered(20_000)
    order = np.random.default_rng(1).permutation(len(points))
    for voxel_m in (0.02, 1e-9):
        means = divespot.voxel_downsample(points, voxel_m)
        shuffled = divespot.voxel_downsample(points[order], voxel_m)
        assert means.tobytes() == shuffled.tobytes()


@pytest.mark.parametrize("per_voxel", [1, 2, 3, 4, 5, 8])
def test_a_regular_grid_falls_evenly_into_voxels(per_voxel: int) -> None:
    side = np.arange(20 * per_voxel) * (0.1 / per_voxel)
    points = np.stack(np.meshgrid(side + 482_310, side, [0.7], indexing="ij"), axis=-1)
    counts = divespot.voxel_downsample(points.reshape(-1, 3), 0.1, return_counts=True)[1]
    edge = int(np.sqrt(len(counts)))
    inner = counts.reshape(edge, edge)[1:-1, 1:-1]
    assert (inner == per_voxel**2).all()


def test_the_mean_of_all_points_is_kept() -> None:
    points = scattered(5000)
    means, counts = divespot.voxel_downsample(points, 0.05, return_counts=True)
    kept = (means * counts[:, None]).sum(axis=0) / counts.sum()
    np.testing.assert_allclose(kept, points.mean(axis=0), rtol=0, atol=1e-12)


def test_power_of_two_scales_give_the_same_bits() -> None:
    points = scattered(5000)
    means = divespot.voxel_downsample(points, 0.0625)
    np.testing.assert_array_equal(divespot.voxel_downsample(points * 1024, 64.0), means * 1024)


def test_more_voxels_than_numbers_are_refused() -> None:
    with pytest.raises(DivespotError, match=r"grid of 1\.0e18 cells: a larger voxel_m"):
        divespot.voxel_downsample([[0.0, 0.0, 0.0], [1e8, 0.0, 0.0]], 1e-10)
