"""Of a large survey, what lies around outlines is read, and no more where the format tells."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot.io.las_stretches
import divespot.streaming
import divespot.too_large
from divespot import DivespotError, measure
from divespot import io as dio
from divespot.narrowing import plan_of
from divespot.settings import Settings
from test_streaming import CONES, CORNER_M, volume_m3, write_las, yard

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

X, Y, _ = CORNER_M
#: A square around the second cone, and the rectangle that is read of the survey.
SQUARE = (X + 21.0, Y + 7.0, X + 31.0, Y + 17.0)
READ = (X + 11.0, Y - 3.0, X + 41.0, Y + 27.0)


def outline(x0: float, y0: float, x1: float, y1: float, **members: Any) -> dict[str, Any]:  # noqa: ANN401
    line = [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]
    return {"type": "Polygon", "coordinates": [line], **members}


@pytest.fixture
def tiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Write a yard in four tiles along x, which is too large to be held."""
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", 50_000)
    monkeypatch.setattr(divespot.streaming, "AIMED_VOXELS", 20_000)
    points = yard(150_000)
    cut = np.digitize(points[:, 0], [9.0, 18.0, 27.0])
    return [write_las(tmp_path / f"{n}.laz", points[cut == n]) for n in range(4)]


@pytest.mark.parametrize("asked", [{"inside": SQUARE}, {"outline": outline(*SQUARE)}])
def test_tiles_beside_outlines_are_not_read(tiles: list[Path], asked: dict[str, Any]) -> None:
    paths = list(map(str, tiles))
    settings = Settings(**asked)
    plan = divespot.streaming.planned(paths, settings)
    assert {stretch.path for stretch in plan.stretches} == set(paths[1:])
    assert np.array_equal(np.array(plan.way.within)[:, :2].ravel(), READ)
    report = measure(tiles, settings)
    (pile,) = report.piles
    assert abs(pile.volume_m3 - volume_m3(*CONES[1][:2])) < pile.u95_m3
    left, right = np.min(report.level.frame.to_scan(places(report)), axis=0), READ[0] - 0.5
    assert left[0] > right


def places(report: Any) -> Any:  # noqa: ANN401 - a report, and an array
    """Return the middles of the cells that were seen, in the level frame."""
    grid = report.level.height_map
    x, y = grid.centers_m()
    seen = np.isfinite(grid.heights_m)
    return np.column_stack([x[seen], y[seen], grid.heights_m[seen]])


def test_of_outlines_elsewhere_it_is_said_where_they_lie(tiles: list[Path]) -> None:
    with pytest.raises(DivespotError, match="outline") as caught:
        measure(tiles, outline=outline(X + 900.0, Y, X + 910.0, Y + 10.0))
    assert "crop" not in str(caught.value)


def test_a_header_that_is_not_true_skips_no_tile(tiles: list[Path]) -> None:
    data = bytearray(tiles[2].read_bytes())
    data[179:227] = np.zeros(6).tobytes()  # the largest and smallest x, y and z
    tiles[2].write_bytes(data)
    plan = divespot.streaming.planned(list(map(str, tiles)), Settings(inside=SQUARE))
    assert str(tiles[2]) in {stretch.path for stretch in plan.stretches}


def test_which_rectangle_is_read() -> None:
    place = (X, Y)

    def found(**asked: Any) -> Any:  # noqa: ANN401 - of settings
        plan = plan_of(Settings(**asked))
        return plan and plan("EPSG:32632", place)

    assert found() is None
    assert found(crop=(*SQUARE[:2], 0.0, *SQUARE[2:], 9.0)) == SQUARE
    assert found(inside=SQUARE) == found(outline=outline(*SQUARE)) == READ
    assert found(inside=SQUARE, base="plane") is None  # fitted to the ground of all
    assert found(inside=SQUARE, compare_bases=True) is None
    assert found(outline={"type": "Polygon", "coordinates": [[["a", 1], None]]}) is None
    assert found(outline="nowhere.geojson") is None
    stated = {"type": "name", "properties": {"name": "EPSG:25832"}}
    plan = plan_of(Settings(outline=outline(*SQUARE, crs=stated)))
    assert plan is not None
    assert plan(None, place) is None  # whether that is the scan's system cannot be told


def test_of_an_octree_only_what_an_outline_needs_is_read(
    real_scan: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = str(real_scan("lone-star.copc.laz"))
    whole = dio.read(path).points
    middle = 0.5 * (whole[:, :2].min(axis=0) + whole[:, :2].max(axis=0))
    settings = Settings(inside=(*(middle - 0.4), *(middle + 0.4)))
    wanted = divespot.too_large.wanted_of(settings)
    count = sum(one.count for one in divespot.io.las_stretches.stretches_of(path, wanted))
    assert 0 < count < len(whole) / 2
    monkeypatch.setattr(divespot.too_large, "MOST_HELD", len(whole) // 2)
    assert divespot.too_large.is_too_large(path, Settings())
    assert not divespot.too_large.is_too_large(path, settings)
