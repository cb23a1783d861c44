"""Text of tripod scanners: PTX, and PTS of several clouds."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np
import pytest

from io_samples import POINTS, read, refused, text
from scanner_samples import MOVED, PLACE, SEEN, TURN, ptx

if TYPE_CHECKING:
    from pathlib import Path


def test_ptx_scans_come_into_one_frame(tmp_path: Path) -> None:
    data = ptx(SEEN[:1]) + ptx(SEEN, TURN, PLACE)
    scan = read(tmp_path, "a.ptx", data)
    np.testing.assert_allclose(scan.points, np.vstack([SEEN[:1], MOVED]), atol=1e-12)
    assert (scan.unit, scan.unit_stated, scan.viewpoint_m) == ("m", True, PLACE)


def test_a_ptx_that_was_not_moved_states_no_place(tmp_path: Path) -> None:
    assert read(tmp_path, "a.ptx", ptx(SEEN)).viewpoint_m is None


def test_ptx_is_known_by_its_content(tmp_path: Path) -> None:
    scan = read(tmp_path, "a.txt", ptx(SEEN, TURN, PLACE).replace(b"\n", b"\r\n"))
    np.testing.assert_allclose(scan.points, MOVED, atol=1e-12)
    assert "PTX" in scan.warnings[0]


def test_colours_of_ptx_are_passed_over(tmp_path: Path) -> None:
    scan = read(tmp_path, "a.ptx", ptx(SEEN).replace(b" 0.5\n", b" 0.5 1 2 3\n"))
    np.testing.assert_array_equal(scan.points, SEEN)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (ptx(SEEN)[:-10], "3 points but 3 rows|fields"),
        (ptx(SEEN).replace(b"3\n1\n", b"3\n400000000\n", 1), "line 1 promises 1200000000 points"),
        (ptx(SEEN) + b"7 7 7 7\n", "line 14 begins no scan"),
        (ptx(SEEN) + ptx(SEEN)[:-20], "the header in line 14 promises 3 points"),
        (ptx(SEEN, 2.0 * TURN), "no rigid motion"),
        (ptx(SEEN, -TURN), "no rigid motion"),
        (ptx(SEEN).replace(b"0.0 0.0 0.0 1.0\n", b"0.0 nan 0.0 1.0\n"), "PTX file inside"),
        (ptx(SEEN).replace(b"0.0 0.0 0.0 1.0\n", b"0.0 1-2 0.0 1.0\n"), "4 rows of 4 numbers"),
        (b"3\n1\n0 0 0\n", "no PTX file inside"),
    ],
)
def test_bad_ptx(tmp_path: Path, data: bytes, words: str) -> None:
    assert re.search(words, refused(tmp_path, "a.ptx", data))


# PTS


def test_pts_of_several_clouds(tmp_path: Path) -> None:
    data = b"5\n" + text(POINTS) + b"2\n" + text(POINTS[:2])
    scan = read(tmp_path, "a.pts", data)
    np.testing.assert_array_equal(scan.points, np.vstack([POINTS, POINTS[:2]]))


@pytest.mark.parametrize("count", [1, 3, 10**12])
def test_a_second_count_that_lies(tmp_path: Path, count: int) -> None:
    data = b"5\n" + text(POINTS) + b"%d\n" % count + text(POINTS[:2])
    assert f"line 7 promises {count} points" in refused(tmp_path, "a.pts", data)
