"""Settings that switch stages off."""

from __future__ import annotations

import numpy as np
import pytest

import divespot
from solids import SOLIDS, sampled

CONE = sampled(SOLIDS["cone"])
TRUTH = SOLIDS["cone"].volume_m3


def turned_about_x(points: np.ndarray, angle_deg: float) -> np.ndarray:
    sin, cos = np.sin(np.radians(angle_deg)), np.cos(np.radians(angle_deg))
    return np.asarray(points @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]]))


def test_a_level_scan_needs_no_pose_correction() -> None:
    report = divespot.measure(CONE, level=False)
    assert report.piles[0].volume_m3 == pytest.approx(TRUTH, rel=1e-3)
    assert report.ground.normal == (0, 0, 1)
    assert report.ground.tilt_deg == 0


def test_up_counts_without_pose_correction() -> None:
    report = divespot.measure(CONE[:, [1, 2, 0]], level=False, up="y")
    assert report.piles[0].volume_m3 == pytest.approx(TRUTH, rel=1e-3)
    assert report.ground.normal == pytest.approx((0, 1, 0))


def test_a_leaning_scan_needs_it() -> None:
    leaning = turned_about_x(CONE, 5)
    assert divespot.measure(leaning).piles[0].volume_m3 == pytest.approx(TRUTH, rel=2e-3)
    without = divespot.measure(leaning, divespot.Settings.paper(level=False))
    found = (*without.piles, *without.other_objects)
    assert all(abs(item.volume_m3 / TRUTH - 1) > 0.1 for item in found)


def test_without_clusters_all_that_stands_is_measured_as_one() -> None:
    two = np.r_[CONE, CONE * [1, 1, 0.75] + [2, 0, 0]]
    with_, without = (
        divespot.measure(two, divespot.Settings.paper(fine_cluster=fine)) for fine in (True, False)
    )
    assert len(without.piles) == 1
    ratio = without.piles[0].volume_m3 / with_.piles[0].volume_m3
    assert ratio == pytest.approx(1.75, rel=0.02)
