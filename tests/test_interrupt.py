"""Ctrl-C ends what runs in native code, soon and with nothing left behind."""

from __future__ import annotations

import os
import signal
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import _native
from interrupt import heap, kernels, until_ended

if TYPE_CHECKING:
    from collections.abc import Iterator

    from interrupt import Interrupter

#: The goal is half a second, on a machine that does nothing else.
MOST_S = 2.0

pytestmark = pytest.mark.skipif(os.name == "nt", reason="no SIGINT to send to one's own process")


@pytest.fixture(autouse=True)
def _own_handler() -> Iterator[None]:
    """A process that was started in the background ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("name", ["fit_plane", "inside", "height_map of triangles", "hdbscan"])
def test_ctrl_c_ends_a_kernel(name: str) -> None:
    call = kernels(heap(200_000))[name]

    def run(interrupter: Interrupter) -> None:
        interrupter.after(0.3)
        while True:
            call()

    assert until_ended(run) < MOST_S


def test_ctrl_c_ends_a_stage_and_the_next_measurement_is_as_before() -> None:
    points = heap(60_000)
    before = divespot.measure(points)

    def run(interrupter: Interrupter) -> None:
        interrupter.after(0.3)
        while True:
            divespot.measure(points)

    assert until_ended(run) < MOST_S
    assert divespot.measure(points).piles == before.piles


def test_an_exception_of_another_handler_ends_a_kernel_too() -> None:
    def handler(*_: object) -> None:
        raise RuntimeError("enough")

    signal.signal(signal.SIGALRM, handler)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    with pytest.raises(RuntimeError, match="enough"):
        divespot.fit_plane(heap(50_000), 1e-9, hypotheses=2**32 - 1)


def test_a_signal_that_raises_nothing_ends_nothing() -> None:
    seen = []
    signal.signal(signal.SIGALRM, lambda *_: seen.append(1))
    signal.setitimer(signal.ITIMER_REAL, 0.05)
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    places = np.random.default_rng(0).uniform(0.0, 2.0, (3_000_000, 2))
    found = _native.inside([corners] * 3, places)
    assert found.mean() == pytest.approx(0.25, abs=0.01)
    assert seen
