"""LZF, under which compressed PCD files lie: as its slow twin reads it, and never a crash."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from divespot import DivespotError
from divespot._native import lzf_decompress
from lzf_twin import compress, decompress

# Few values, so that they recur, and any.
_DATA = st.one_of(
    st.lists(st.sampled_from([b"ab", b"c", b"\0" * 300, b"abcd"])).map(b"".join),
    st.binary(max_size=400),
)


@given(_DATA)
def test_what_was_compressed_comes_back(data: bytes) -> None:
    packed = compress(data)
    assert decompress(packed) == data
    assert lzf_decompress(packed, len(data)).tobytes() == data


@pytest.mark.parametrize("length", [3, 8, 9, 10, 263, 264, 265, 5000])
@pytest.mark.parametrize("period", [1, 2, 31, 8191, 8192, 8193])
def test_lengths_and_distances_at_their_limits(length: int, period: int) -> None:
    start = np.random.default_rng(1).integers(0, 256, period, np.uint8).tobytes()
    data = (start * (2 + length // period))[: period + length]
    assert lzf_decompress(compress(data), len(data)).tobytes() == data


def test_points_as_a_writer_lays_them() -> None:
    columns = np.random.default_rng(2).normal(0, 1, (3, 5000)).round(2).astype("<f4").tobytes()
    packed = compress(columns)
    assert len(packed) < len(columns)
    assert lzf_decompress(packed, len(columns)).tobytes() == columns


@given(st.binary(max_size=60), st.integers(0, 600))
def test_any_bytes_end_as_with_the_twin(packed: bytes, size: int) -> None:
    expected = decompress(packed)
    if expected is not None and len(expected) == size:
        assert lzf_decompress(packed, size).tobytes() == expected
    else:
        with pytest.raises(DivespotError, match="intact data are needed"):
            lzf_decompress(packed, size)


@pytest.mark.parametrize(
    ("packed", "size", "words"),
    [
        (b"\x05ab", 6, "end within a run"),
        (b"\x00a\x20", 4, "end within a run"),
        (b"\x00a\xe0\x05", 15, "end within a run"),
        (b"\x20\x00", 3, "before their start"),
        (b"\x00a\x20\x01", 4, "before their start"),
        (b"\x00a\xe0\xff\x00", 100, "more than promised"),
        (b"\x00a", 100, "less than promised"),
        (b"", 1, "less than promised"),
    ],
)
def test_what_is_corrupt_is_told(packed: bytes, size: int, words: str) -> None:
    with pytest.raises(DivespotError, match=words):
        lzf_decompress(packed, size)


def test_memory_follows_from_the_data_and_not_from_what_they_promise() -> None:
    tracemalloc.start()
    with pytest.raises(DivespotError, match="less than promised"):
        lzf_decompress(b"\x00a" * 1000, 1 << 62)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1 << 20
