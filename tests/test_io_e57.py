"""E57: several scans with their poses, invalid points, and files that are damaged."""

from __future__ import annotations

import contextlib
import re
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import divespot
from divespot import DivespotError
from divespot import io as dio
from io_samples import read, refused
from scanner_samples import (
    MOVED,
    PLACE,
    SEEN,
    TURN,
    cartesian,
    e57,
    with_checksums,
    without_checksums,
)
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

QUARTER = (0.5**0.5, 0.0, 0.0, 0.5**0.5)


def test_e57_scans_come_into_one_frame(tmp_path: Path) -> None:
    data = e57((cartesian(SEEN[:1]), None), (cartesian(SEEN), (*QUARTER, *PLACE)))
    scan = read(tmp_path, "a.e57", data)
    np.testing.assert_allclose(scan.points, np.vstack([SEEN[:1], MOVED]), atol=1e-12)
    assert (scan.unit, scan.unit_stated, scan.viewpoint_m) == ("m", True, PLACE)


def test_a_quaternion_of_another_length_is_a_rotation(tmp_path: Path) -> None:
    pose = (*(3.0 * q for q in QUARTER), *PLACE)
    scan = read(tmp_path, "a.e57", e57((cartesian(SEEN), pose)))
    np.testing.assert_allclose(scan.points, MOVED, atol=1e-12)


def test_invalid_points_of_e57_are_dropped_and_counted(tmp_path: Path) -> None:
    points = sampled(SOLIDS["cone"], 2.0**-6, (1.25, 1.125))
    state = np.zeros(len(points), np.uint8)
    state[::7], state[3::7] = 1, 2
    whole = divespot.measure(points[state == 0])
    # 64 kB a packet: several scans.
    parts = [slice(at, at + 2000) for at in range(0, len(points), 2000)]
    scans: Any = [
        ({**cartesian(points[part]), "cartesianInvalidState": state[part]}, None) for part in parts
    ]
    path = tmp_path / "a.e57"
    path.write_bytes(e57(*scans))
    report = divespot.measure(path)
    assert report.source.dropped_nonfinite == np.count_nonzero(state)
    assert report.total == whole.total


def spherical(points: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    x, y, z = points.T
    return {
        "sphericalRange": np.linalg.norm(points, axis=1),
        "sphericalAzimuth": np.arctan2(y, x),
        "sphericalElevation": np.arctan2(z, np.hypot(x, y)),
        "sphericalInvalidState": np.array([0, 0, 0, 1, 2][: len(points)], np.uint8),
    }


def test_spherical_coordinates_of_e57(tmp_path: Path) -> None:
    points = np.array([[1.0, 2, 3], [-4, 5, -6], [0, -1, 0], [1, 1, 1], [2, 2, 2]])
    found = read(tmp_path, "a.e57", e57((spherical(points), None))).points
    np.testing.assert_allclose(found[:3], points[:3], atol=1e-14)
    assert np.isnan(found[3:]).all()


def test_spherical_coordinates_stand_in_for_invalid_cartesian_ones(tmp_path: Path) -> None:
    columns = {
        **cartesian(np.full((3, 3), 7.0)),
        "cartesianInvalidState": np.array([0, 2, 1], np.uint8),
        **spherical(SEEN),
    }
    found = read(tmp_path, "a.e57", e57((columns, None))).points
    np.testing.assert_allclose(found, [[7, 7, 7], *SEEN[1:].tolist()], atol=1e-14)


def test_the_reference_system_of_e57(tmp_path: Path) -> None:
    wkt = 'PROJCS["UTM",GEOGCS["WGS 84"],PROJECTION["Transverse_Mercator"],UNIT["metre",1]]'
    scan = read(tmp_path, "a.e57", e57((cartesian(SEEN), None), wkt=wkt))
    assert (scan.crs, scan.projected) == (wkt, True)
    mercator = wkt.replace("Transverse_Mercator", "Mercator_1SP")
    assert "projection to metres" in refused(
        tmp_path, "a.e57", e57((cartesian(SEEN), None), wkt=mercator)
    )


GOOD = e57((cartesian(SEEN), None))


def edited(old: bytes, new: bytes) -> bytes:
    """Return the file with its text changed and its checksums right."""
    body = without_checksums(GOOD)
    assert old in body
    assert len(new) <= len(old)
    return with_checksums(body.replace(old, new + b" " * (len(old) - len(new))))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (GOOD[:-1], "not a readable E57"),
        (GOOD[:1000], "not a readable E57"),
        (GOOD[:20], "not a readable E57"),
        (GOOD[:900] + b"\xff" + GOOD[901:], "checksum"),
        (e57(), "0 points"),
        (e57((cartesian(SEEN[:0]), None)), "0 points"),
        (edited(b'recordCount="3"', b'recordCount="4"'), "not a readable E57"),
        (edited(b'<formatName type="String">', b'<formatName type="S">'), "not a readable E57"),
        (edited(b"cartesianZ", b"returnMax"), "not a readable E57|neither Cartesian"),
        (e57((cartesian(SEEN), (0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0))), "no rigid motion"),
    ],
)
def test_bad_e57(tmp_path: Path, data: bytes, words: str) -> None:
    assert re.search(words, refused(tmp_path, "a.e57", data))


def test_a_count_of_e57_that_lies_takes_no_memory(tmp_path: Path) -> None:
    lie = e57((cartesian(SEEN), None), promised=10**11)
    assert "promises 100000000000 points" in refused(tmp_path, "a.e57", lie)


def test_columns_without_any_bits_end(tmp_path: Path) -> None:
    same = {name: np.zeros(3, np.uint8) for name in cartesian(SEEN)}
    body = without_checksums(e57((same, None))).replace(b'maximum="255"', b'maximum="0"  ')
    assert "one and the same" in refused(tmp_path, "a.e57", with_checksums(body))


def test_e57_as_another_library_writes_it(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        pye57 = pytest.importorskip("pye57", reason="pye57 has no wheel for this machine")
    points = sampled(SOLIDS["cone"], 2.0**-6, (1.25, 1.125))
    path = tmp_path / "a.e57"
    with pye57.E57(str(path), mode="w") as file:
        columns = cartesian(points)
        file.write_scan_raw(columns, rotation=np.array(QUARTER), translation=np.array(PLACE))
        file.write_scan_raw(columns)
    scan = dio.read(path)
    moved = points @ TURN.T + PLACE
    np.testing.assert_allclose(scan.points, np.vstack([moved, points]), atol=1e-9)


def test_read_e57_takes_bytes() -> None:
    with pytest.raises(DivespotError, match=r"truncated|signature|header"):
        divespot._native.read_e57(b"ASTM-E57")


BODY = without_checksums(e57((spherical(SEEN), None), (cartesian(SEEN), (*QUARTER, *PLACE))))


@given(st.lists(st.tuples(st.integers(0, len(BODY) - 1), st.integers(0, 255)), max_size=4))
@settings(max_examples=150, deadline=None)
def test_bytes_flipped_under_right_checksums(
    tmp_path_factory: pytest.TempPathFactory, flips: list[tuple[int, int]]
) -> None:
    data = bytearray(BODY)
    for at, value in flips:
        data[at] = value
    path = tmp_path_factory.getbasetemp() / "flipped.e57"
    path.write_bytes(with_checksums(bytes(data)))
    with contextlib.suppress(DivespotError):
        dio.read(path)
