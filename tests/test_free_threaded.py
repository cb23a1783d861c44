"""Threads of Python side by side, on an interpreter without a global lock above all."""

from __future__ import annotations

import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from divespot import _native, radius_outlier_mask, voxel_downsample


@pytest.mark.skipif(
    not sysconfig.get_config_var("Py_GIL_DISABLED"), reason="this Python has a global lock"
)
def test_the_kernels_bring_no_global_lock_back() -> None:
    assert _native.__version__
    assert not getattr(sys, "_is_gil_enabled", lambda: True)()


def test_threads_that_read_one_array_get_the_same_bits() -> None:
    points = np.random.default_rng(0).uniform(0.0, 1.0, (20_000, 3))
    expected = voxel_downsample(points, 0.05), radius_outlier_mask(points, 0.03, 3)
    with ThreadPoolExecutor(4) as pool:
        voxels = [pool.submit(voxel_downsample, points, 0.05) for _ in range(8)]
        masks = [pool.submit(radius_outlier_mask, points, 0.03, 3) for _ in range(8)]
    assert all(np.array_equal(found.result(), expected[0]) for found in voxels)
    assert all(np.array_equal(found.result(), expected[1]) for found in masks)
