"""Points added up in voxels: the definition, any order, any chunks, any bytes."""

from __future__ import annotations

import pickle
from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cases import scattered
from divespot import DivespotError
from divespot.scale import Accumulator

if TYPE_CHECKING:
    from random import Random

    from numpy.typing import NDArray


def added(points: NDArray[np.floating], voxel_m: float = 0.05, most: int = 2**22) -> Accumulator:
    all_of_them = Accumulator(voxel_m, most=most)
    all_of_them.add(points)
    return all_of_them


def by_definition(
    points: NDArray[np.float64], voxel_m: float
) -> dict[tuple[int, ...], list[NDArray[np.float64]]]:
    voxels = defaultdict(list)
    for point in points:
        voxels[tuple(np.floor(point / voxel_m).astype(int))].append(point)
    return voxels


@pytest.mark.parametrize("most", [2**22, 500, 20])
def test_voxels_hold_what_the_definition_says(most: int) -> None:
    points = scattered(3000)
    found = added(points, 0.05, most)
    expected = by_definition(points, found.voxel_m)
    held = found.held()
    assert found.voxels == len(expected) == len(held.means) <= most
    assert found.points == held.counts.sum() == 3000
    for mean, count, (low, high) in zip(held.means, held.counts, held.bounds_m, strict=True):
        own = np.array(expected[tuple(np.floor(mean / found.voxel_m).astype(int))])
        assert count == len(own)
        np.testing.assert_allclose(mean, own.mean(axis=0), atol=1e-5 * found.voxel_m)
        assert low == pytest.approx(own[:, 2].min(), abs=3e-5 * found.voxel_m)
        assert high == pytest.approx(own[:, 2].max(), abs=3e-5 * found.voxel_m)


def test_edges_double_no_more_often_than_needed() -> None:
    points = scattered(3000)
    edge_m = added(points, 0.05, 500).voxel_m
    assert added(points, edge_m / 2).voxels > 500 >= added(points, edge_m).voxels


@settings(max_examples=12, deadline=None)
@given(st.randoms(use_true_random=False), st.integers(1, 40), st.sampled_from([3, 200, 2**22]))
def test_order_chunks_and_merges_change_no_bit(random: Random, chunks: int, most: int) -> None:
    points = scattered(800)
    expected = added(points, 0.05, most).to_bytes()
    order = random.sample(range(800), 800)
    parts = [added(part, 0.05, most) for part in np.array_split(points[order], chunks)]
    random.shuffle(parts)
    while len(parts) > 1:
        parts[0].merge(parts.pop())
    assert parts[0].to_bytes() == expected


def test_a_thousand_chunks_in_any_order_are_one() -> None:
    points = scattered(20_000)
    rng = np.random.default_rng(3)
    chunks = np.array_split(points[rng.permutation(len(points))], 1000)
    found = Accumulator(0.05, most=500)
    for number in rng.permutation(1000):
        found.add(chunks[number])
    assert found.to_bytes() == added(points, 0.05, 500).to_bytes()


def test_bytes_and_pickles_bring_everything_back() -> None:
    found = added(np.vstack([scattered(500), [[0.0] * 3, [np.nan] * 3]]), 0.05, 300)
    for again in (Accumulator.from_bytes(found.to_bytes()), pickle.loads(pickle.dumps(found))):  # noqa: S301
        assert again.to_bytes() == found.to_bytes()
        assert again.dropped == found.dropped == (1, 1)
        assert again.held().means.tobytes() == found.held().means.tobytes()


def test_damaged_bytes_are_refused_in_a_sentence() -> None:
    data = added(scattered(500)).to_bytes()
    for damaged in (b"", data[:-1], data + b"\0", b"x" + data[1:], data[:72] + b"\xff" * 8):
        with pytest.raises(DivespotError, match="intact data are needed"):
            Accumulator.from_bytes(damaged)
    with pytest.raises(DivespotError, match="bytes are needed"):
        Accumulator.from_bytes("text")  # type: ignore[arg-type]


def test_points_of_either_type_and_any_strides_are_taken() -> None:
    points = scattered(500).astype(np.float32)
    wide = np.zeros((500, 7), np.float32)
    wide[:, 1:6:2] = points
    expected = added(points.astype(np.float64)).to_bytes()
    assert added(points).to_bytes() == added(wide[:, 1:6:2]).to_bytes() == expected


def test_what_cannot_be_added_is_refused() -> None:
    for voxel_m in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(DivespotError, match="voxel_m"):
            Accumulator(voxel_m)
    with pytest.raises(DivespotError, match="most"):
        Accumulator(1.0, most=0)
    with pytest.raises(DivespotError, match="three are needed"):
        Accumulator(1.0, origin_m=(0.0, 0.0))
    with pytest.raises(DivespotError, match="shape"):
        Accumulator(1.0).add([[1.0, 2.0]])
    with pytest.raises(DivespotError, match="a larger voxel_m"):
        Accumulator(1e-9).add([[1e6, 0.0, 0.0]])
    with pytest.raises(DivespotError, match="accumulators of other voxels were given: the same"):
        Accumulator(1.0).merge(Accumulator(2.0))
    with pytest.raises(TypeError, match="Accumulator is needed"):
        Accumulator(1.0).merge(b"")  # type: ignore[arg-type]
