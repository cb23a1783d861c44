"""Scans too large to be held: the same piles, from the means of voxels read in one pass."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import laspy
import numpy as np
import pytest

import divespot.one_pass
import divespot.streaming
import divespot.too_large
from divespot import DivespotError, measure
from divespot import io as dio
from divespot.settings import Settings

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from divespot import Report

CORNER_M = (482_300.0, 5_456_700.0, 312.0)
#: Streaming moves a volume by less than this share of its u95.
SHARE = 0.5
#: Radius and rise of two cones, and their middles.
CONES = ((6.0, 0.6, 10.0, 10.0), (4.0, 0.5, 26.0, 12.0))


def yard(count: int = 240_000, seed: int = 0) -> NDArray[np.float64]:
    """Return points of two cones on a floor of 36 by 20 m."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0.0, 1.0, (2, count)) * np.array([[36.0], [20.0]])
    z = rng.normal(0.0, 0.01, count)
    for radius, rise, x0, y0 in CONES:
        z += rise * np.maximum(0.0, radius - np.hypot(x - x0, y - y0))
    return np.column_stack([x, y, z])


def volume_m3(radius: float, rise: float) -> float:
    return math.pi * radius**3 * rise / 3.0


def write_las(path: Path, points: NDArray[np.float64], kind: int = 6, **fields: Any) -> Path:  # noqa: ANN401
    header = laspy.LasHeader(point_format=kind, version="1.4")
    header.scales, header.offsets = [0.001] * 3, CORNER_M
    with laspy.open(path, mode="w", header=header) as writer:
        record = laspy.ScaleAwarePointRecord.zeros(len(points), header=header)
        record.x, record.y, record.z = (points + CORNER_M).T
        record.return_number[:] = record.number_of_returns[:] = 1
        for name, values in fields.items():
            record[name][:] = values
        writer.write_points(record)
    return path


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    points = yard()
    points = points[np.lexsort((points[:, 0], np.floor(points[:, 1] / 0.5)))]
    return write_las(tmp_path_factory.mktemp("yard") / "yard.laz", points)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stream from 100,000 points on, aiming at a quarter of them."""
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", 100_000)
    monkeypatch.setattr(divespot.streaming, "AIMED_VOXELS", 40_000)


def bits(report: Report) -> dict[str, Any]:
    kept = report.to_dict()
    kept.pop("timings_s")
    kept["settings"].pop("threads")
    return kept


def test_streaming_moves_no_volume_by_much_of_its_uncertainty(
    scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = measure(scene)
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", 100_000)
    monkeypatch.setattr(divespot.streaming, "AIMED_VOXELS", 40_000)
    streamed = measure(scene)
    assert streamed.source.points == whole.source.points == 240_000
    assert any("read in one pass and averaged in voxels" in told for told in streamed.warnings)
    assert not any("one pass" in told for told in whole.warnings)
    assert len(whole.piles) == len(streamed.piles) == 2
    for one, other, (radius, rise, *_) in zip(whole.piles, streamed.piles, CONES, strict=True):
        truth = volume_m3(radius, rise)
        assert abs(one.volume_m3 - other.volume_m3) < SHARE * one.u95_m3
        assert abs(other.volume_m3 / truth - 1.0) < 0.005
        assert abs(other.volume_m3 - truth) < other.u95_m3


@pytest.mark.usefixtures("small")
def test_threads_and_tiles_change_no_bit(scene: Path, tmp_path: Path) -> None:
    expected = measure(scene, threads=1)
    assert bits(measure(scene, threads=3)) == bits(expected)
    las = laspy.read(scene)
    order = np.random.default_rng(1).permutation(len(las.points))
    tiles = []
    for number, part in enumerate(np.array_split(order, 3)):
        tile = laspy.LasData(las.header, las.points[part])
        tile.write(tmp_path / f"{number}.laz")
        tiles.append(tmp_path / f"{number}.laz")
    plan = divespot.streaming.planned([str(scene)], Settings())
    tiled = divespot.streaming.planned([str(tile) for tile in tiles], Settings())
    one = divespot.streaming.read(plan, 2).voxels.to_bytes()
    several = divespot.one_pass.Plan(tiled.stretches, plan.way, tiled.sample)
    assert divespot.streaming.read(several, 2).voxels.to_bytes() == one
    report = measure(tiles)
    assert report.source.files == tuple(map(str, tiles))
    assert report.source.points == 240_000
    assert abs(report.piles[0].volume_m3 - expected.piles[0].volume_m3) < expected.piles[0].u95_m3


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("kind", [0, 6])
def test_classes_returns_and_withheld_points_count_as_ever(kind: int, tmp_path: Path) -> None:
    points = yard(150_000)
    rng = np.random.default_rng(2)
    fields = {
        "classification": rng.choice([2, 5, 7], 150_000, p=[0.8, 0.1, 0.1]),
        "withheld": rng.random(150_000) < 0.01,
        "number_of_returns": 2,
        "return_number": rng.choice([1, 2], 150_000, p=[0.9, 0.1]),
    }
    path = write_las(tmp_path / "yard.las", points, kind, **fields)
    for asked in ({}, {"classes": "2"}, {"classes": "2,7", "returns": "first"}):
        held = dio.read(path, **asked)  # type: ignore[arg-type]
        plan = divespot.streaming.planned([str(path)], Settings(**asked))  # type: ignore[arg-type]
        scan = divespot.streaming.scan_of(plan, divespot.streaming.read(plan, 2))
        assert scan.streamed is not None
        assert scan.streamed.points == len(held.points)
        assert set(held.warnings) < set(scan.warnings)
    with pytest.raises(DivespotError, match="others are needed, its classes are 2, 5, 7"):
        measure(path, classes="3")


@pytest.mark.usefixtures("small")
def test_a_crop_is_taken_while_reading(scene: Path) -> None:
    x, y, z = CORNER_M
    report = measure(scene, crop=(x, y, z - 1, x + 18.0, y + 20.0, z + 9))
    (pile,) = report.piles
    assert abs(pile.volume_m3 / volume_m3(*CONES[0][:2]) - 1.0) < 0.005
    with pytest.raises(DivespotError, match="240000 are outside the crop"):
        measure(scene, crop=(0.0, 0.0, 0.0, 1.0, 1.0, 1.0))


@pytest.mark.usefixtures("small")
def test_heights_that_mean_no_data_are_dropped_and_counted(tmp_path: Path) -> None:
    points = yard(150_000)
    points[::100, 2] = -9999.0 - CORNER_M[2]
    report = measure(write_las(tmp_path / "yard.laz", points))
    assert any("1500 points share a height" in told for told in report.warnings)
    assert abs(report.piles[0].volume_m3 / volume_m3(*CONES[0][:2]) - 1.0) < 0.005


@pytest.mark.usefixtures("small")
def test_piles_ten_kilometres_apart_are_found_in_little_memory(tmp_path: Path) -> None:
    points = yard(150_000)
    points[points[:, 0] > 18.0, 0] += 10_000.0
    large, small = measure(write_las(tmp_path / "far.laz", points)).piles
    for pile, (radius, rise, x, _), far_m in ((large, CONES[0], 0.0), (small, CONES[1], 1e4)):
        assert abs(pile.volume_m3 / volume_m3(radius, rise) - 1.0) < 0.01
        assert pile.centroid_m[0] - CORNER_M[0] - far_m == pytest.approx(x, abs=0.05)


@pytest.mark.usefixtures("small")
def test_a_damaged_file_is_refused_in_a_sentence(scene: Path, tmp_path: Path) -> None:
    data = scene.read_bytes()
    cut = tmp_path / "cut.laz"
    cut.write_bytes(data[: len(data) // 2])
    with pytest.raises(DivespotError, match=r"cut\.laz: "):
        measure(cut)
    scratched = bytearray(data)
    scratched[len(data) // 2 : len(data) // 2 + 2000] = b"\xff" * 2000
    cut.write_bytes(scratched)
    try:
        measure(cut)
    except DivespotError as err:
        assert "cut.laz: " in str(err)  # noqa: PT017 - or it decodes to other points
    counted = bytearray(data)
    counted[247:255] = (2**40).to_bytes(8, "little")
    cut.write_bytes(counted)
    with pytest.raises(DivespotError, match=r"cut\.laz: the header promises"):
        measure(cut)


def test_what_is_not_large_or_no_las_file_is_held(scene: Path, tmp_path: Path) -> None:
    assert not divespot.too_large.is_too_large(str(scene), Settings())
    np.save(tmp_path / "scan.npy", yard(1000))
    assert not divespot.too_large.is_too_large(tmp_path / "scan.npy", Settings())
    assert not divespot.too_large.is_too_large(tmp_path / "missing.laz", Settings())


@pytest.mark.usefixtures("small")
def test_the_papers_way_needs_every_point(scene: Path) -> None:
    assert divespot.too_large.is_too_large(scene, Settings())
    assert not divespot.too_large.is_too_large(scene, Settings.paper())


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("version", ["1.2", "1.4"])
def test_points_are_counted_as_the_header_has_them(version: str, tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version=version)
    for count, is_large in ((100_000, False), (100_001, True)):
        with laspy.open(tmp_path / "scan.las", mode="w", header=header) as writer:
            writer.write_points(laspy.ScaleAwarePointRecord.zeros(count, header=header))
        found = divespot.too_large.is_too_large(tmp_path / "scan.las", Settings())
        assert found == is_large


def test_of_an_octree_only_what_is_cropped_is_read(
    real_scan: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = str(real_scan("lone-star.copc.laz"))
    whole = dio.read(path).points
    low, high = whole.min(axis=0), whole.max(axis=0)
    middle = (low + high) / 2
    crop = (*(middle[:2] - 3.0), low[2] - 1.0, *(middle[:2] + 2.0), high[2] + 1.0)
    corners = np.array(crop).reshape(2, 3)
    inside = ((whole >= corners[0]) & (whole <= corners[1])).all(axis=1).sum()
    settings = Settings(crop=crop)
    plan = divespot.streaming.planned([path], settings)
    assert inside < sum(stretch.count for stretch in plan.stretches) < len(whole) / 2
    part = divespot.streaming.read(plan, 2)
    assert part.voxels.points == part.counts[0] - part.counts[1] == inside
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", len(whole) // 2)
    assert divespot.too_large.is_too_large(path, Settings())
    assert not divespot.too_large.is_too_large(path, settings)
