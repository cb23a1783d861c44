"""HDBSCAN against the package of that name, and its own promises."""

import itertools
import os
import signal
import subprocess
import sys
import time
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

import divespot
from divespot import DivespotError

Floats = NDArray[np.float64]
Labels = NDArray[np.int64]

GRID = [
    {
        "min_samples": min_samples,
        "min_cluster_size": min_cluster_size,
        "cluster_selection_epsilon": epsilon,
        "allow_single_cluster": single,
        "cluster_selection_method": method,
    }
    for min_samples, min_cluster_size in itertools.product((1, 5, 10, 50), (5, 50, 500))
    for epsilon, single, method in (
        (0.0, False, "eom"),
        (0.05, False, "eom"),
        (0.0, True, "eom"),
        (0.05, True, "eom"),
        (0.0, False, "leaf"),
        (0.05, False, "leaf"),
    )
]


def blobs(count: int, seed: int) -> Floats:
    """Twelve balls of different density in a thin fog."""
    rng = np.random.default_rng(seed)
    which = rng.integers(0, 12, count)
    centres = 4 * rng.random((12, 3))
    spread = 0.05 + 0.2 * rng.random(12)
    points = centres[which] + rng.normal(size=(count, 3)) * spread[which, None]
    points[: count // 10] = 4 * rng.random((count // 10, 3))
    return points


def room(count: int, seed: int) -> Floats:
    """A floor, a wall, a heap and strays, as a depth camera sees them."""
    rng = np.random.default_rng(seed)
    u, v = rng.random((2, count))
    floor = np.stack([3 * u, 2 * v, np.zeros(count)], axis=1)
    wall = np.stack([3 * u, np.full(count, 2.0), v], axis=1)
    reach, angle = 0.5 * np.sqrt(u), 2 * np.pi * v
    x, y = 1.4 + reach * np.cos(angle), 1 + reach * np.sin(angle)
    heap = np.stack([x, y, 0.45 * (0.5 - reach)], axis=1)
    stray = np.stack([3 * u, 2 * v, rng.random(count)], axis=1)
    kind = rng.choice(4, count, p=[0.55, 0.25, 0.195, 0.005])
    points = np.choose(kind[:, None], [floor, wall, heap, stray])
    return np.asarray(points + rng.normal(0, 0.0015, points.shape))


def cube(count: int, seed: int) -> Floats:
    """Points all over a cube."""
    return np.random.default_rng(seed).random((count, 3))


def oracle(points: Floats, **settings: Any) -> Any:  # noqa: ANN401 - the package is untyped
    """Fit the package's exact variant."""
    package = pytest.importorskip("hdbscan", reason="the hdbscan package is not installed")
    return package.HDBSCAN(
        approx_min_span_tree=False,
        gen_min_span_tree=True,
        core_dist_n_jobs=1,
        algorithm="boruvka_kdtree",
        **settings,
    ).fit(points)


def settled(fitted: Any) -> Labels:  # noqa: ANN401 - the package is untyped
    """Return the package's labels, without points that leave a cluster the moment it is born.

    Such points merge with several clusters at one distance. To which of them the package gives
    them depends on the order of the points; ours gives them to none.
    """
    labels: Labels = fitted.labels_.copy()
    tree = fitted.condensed_tree_.to_numpy()
    density = np.zeros(tree["child"].max() + 1)
    density[tree["child"]] = tree["lambda_val"]
    clusters = np.array(sorted(fitted.condensed_tree_._select_clusters()), dtype=int)
    if labels.max() < 1:  # nothing, or the whole cloud
        return labels
    born = density[clusters[labels]]
    labels[density[: len(labels)] == born] = -1
    return labels


def differing(a: Labels, b: Labels) -> int:
    """Count the points on which two clusterings differ under the best renumbering."""
    shared = np.zeros((a.max() + 2, b.max() + 2), dtype=int)
    np.add.at(shared, (a + 1, b + 1), 1)
    best = linear_sum_assignment(-shared[1:, 1:])
    return len(a) - int(shared[0, 0] + shared[1:, 1:][best].sum())


def compare(cloud: Any, count: int, settings: dict[str, Any]) -> None:  # noqa: ANN401
    # In some clouds a cluster is just large enough by one point that a tie gives it.
    points = cloud(count, 3)
    fitted = oracle(points, **settings)
    ours = divespot.hdbscan(points, **settings, details=True)
    weights = np.sort(fitted.minimum_spanning_tree_.to_numpy()[:, 2])
    np.testing.assert_allclose(ours.mst_weights_m, weights, rtol=1e-3, atol=1e-6)
    np.testing.assert_allclose(ours.mst_weights_m.sum(), weights.sum(), rtol=1e-6)
    expected = settled(fitted)
    if settings["min_cluster_size"] > settings["min_samples"] + 1:
        assert differing(ours.labels, expected) == 0
        same = expected == fitted.labels_
        np.testing.assert_allclose(ours.probabilities[same], fitted.probabilities_[same], atol=1e-4)
    else:
        # One point and what hangs on it can be a cluster of its own for an instant, in one
        # order of the package's edges and not in another: its own labels differ as much.
        assert differing(ours.labels, expected) <= 0.15 * count


@pytest.mark.parametrize("cloud", [blobs, room, cube])
@pytest.mark.parametrize("settings", GRID, ids=lambda s: "-".join(map(str, s.values())))
def test_labels_are_those_of_the_package(cloud: Any, settings: dict[str, Any]) -> None:  # noqa: ANN401
    compare(cloud, 2000, settings)


@pytest.mark.parametrize("cloud", [blobs, room, cube])
@pytest.mark.parametrize("settings", GRID[24:48:6], ids=lambda s: "-".join(map(str, s.values())))
def test_labels_of_larger_clouds_are_those_of_the_package(
    cloud: Any,  # noqa: ANN401
    settings: dict[str, Any],
) -> None:
    compare(cloud, 10_000, settings)


def test_ties_leave_tree_and_clusters_alone() -> None:
    points = np.round(blobs(6000, 3), 3)
    points = np.concatenate([points, points[:500]])
    fitted = oracle(points, min_cluster_size=100, min_samples=10)
    ours = divespot.hdbscan(points, min_cluster_size=100, min_samples=10, details=True)
    weights = fitted.minimum_spanning_tree_.to_numpy()[:, 2]
    np.testing.assert_allclose(ours.mst_weights_m.sum(), weights.sum(), rtol=1e-6)
    assert differing(ours.labels, fitted.labels_) <= 0.001 * len(points) + 1


def test_order_threads_strides_and_place_change_nothing() -> None:
    points = room(20_000, 2)
    labels = divespot.hdbscan(points, min_cluster_size=100, min_samples=10, threads=1)
    order = np.random.default_rng(0).permutation(len(points))
    shuffled = divespot.hdbscan(points[order], min_cluster_size=100, min_samples=10, threads=3)
    np.testing.assert_array_equal(shuffled, labels[order])
    strided = np.asfortranarray(np.repeat(points, 2, axis=0))[::2]
    np.testing.assert_array_equal(
        divespot.hdbscan(strided, min_cluster_size=100, min_samples=10), labels
    )
    assert labels.dtype == np.int64
    sizes = np.bincount(labels[labels >= 0])
    assert np.all(np.diff(sizes) <= 0)


def test_float32_is_as_good() -> None:
    points = room(5000, 4).astype(np.float32)
    np.testing.assert_array_equal(
        divespot.hdbscan(points, min_cluster_size=50),
        divespot.hdbscan(points.astype(np.float64), min_cluster_size=50),
    )


def test_rows_that_are_not_finite_are_noise() -> None:
    points = blobs(3000, 5)
    holes = points.copy()
    holes[::10, 1] = np.nan
    holes[5, 0] = np.inf
    finite = np.isfinite(holes).all(axis=1)
    found = divespot.hdbscan(holes, min_cluster_size=30, details=True)
    alone = divespot.hdbscan(holes[finite], min_cluster_size=30, details=True)
    np.testing.assert_array_equal(found.labels[finite], alone.labels)
    np.testing.assert_array_equal(found.probabilities[finite], alone.probabilities)
    assert np.all(found.labels[~finite] == -1)
    assert np.all(found.probabilities[~finite] == 0)
    assert len(found.mst_weights_m) == finite.sum() - 1


@pytest.mark.parametrize("count", [0, 1, 2, 49])
def test_few_points_are_noise(count: int) -> None:
    labels = divespot.hdbscan(cube(count, 0), min_cluster_size=50)
    np.testing.assert_array_equal(labels, np.full(count, -1))


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"min_cluster_size": 1}, "min_cluster_size is 1: 2 or more is needed"),
        ({"min_cluster_size": 2.5}, "min_cluster_size is 2.5: a whole number"),
        ({"min_samples": 0}, "min_samples is 0: 1 or more is needed"),
        ({"min_samples": -3}, "min_samples is -3: a whole number"),
        ({"cluster_selection_epsilon": -1.0}, "cluster_selection_epsilon is -1: a finite"),
        ({"cluster_selection_epsilon": np.nan}, "cluster_selection_epsilon is NaN: a finite"),
        ({"cluster_selection_method": "best"}, 'cluster_selection_method is "best": "eom" or'),
    ],
)
def test_bad_settings_are_named(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(DivespotError, match=said):
        divespot.hdbscan(cube(10, 0), **settings)


def test_a_wrong_shape_is_named() -> None:
    with pytest.raises(DivespotError, match=r"shape \(10, 2\)"):
        divespot.hdbscan(np.zeros((10, 2)))


# A shell's background jobs start with SIGINT ignored.
INTERRUPTED = """
import signal
import numpy as np, divespot
signal.signal(signal.SIGINT, signal.default_int_handler)
points = np.random.default_rng(0).random((1_000_000, 3))
print("ready", flush=True)
try:
    while True:
        divespot.hdbscan(points, min_cluster_size=100, min_samples=50)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows sends no SIGINT to one child")
def test_ctrl_c_ends_a_long_run_soon() -> None:
    command = [sys.executable, "-c", INTERRUPTED]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:  # noqa: S603
        assert child.stdout is not None
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.4)
        child.send_signal(signal.SIGINT)
        start = time.monotonic()
        assert child.stdout.readline() == "interrupted\n"
        assert time.monotonic() - start < 2
    assert child.returncode == 0
