"""Measuring inside outlines: closed forms, frames, and files that are refused."""

from __future__ import annotations

import json
import os
import time
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import DivespotError, Report, Settings
from divespot.outline_file import read_regions
from solids import SOLIDS, Floats, raster, sampled

if TYPE_CHECKING:
    from pathlib import Path


STEP_M = 2.0**-6
UTM_M = np.array([482_310.0, 5_456_790.0, 312.0])


@cache
def cone() -> Floats:
    return sampled(SOLIDS["cone"], STEP_M, (1.25, 1.125))


@cache
def wedge() -> Floats:
    """Return a slope of 1 in 4 beside a level floor: z = max(x, 0) / 4."""
    x, y = raster(80, 72, STEP_M)
    return np.column_stack([x, y, np.maximum(x, 0.0) / 4])


def square(half: float, at: tuple[float, float] = (0.0, 0.0)) -> list[list[float]]:
    (x, y), h = at, half
    return [[x - h, y - h], [x + h, y - h], [x + h, y + h], [x - h, y + h], [x - h, y - h]]


def circle(radius: float, corners: int = 200) -> list[list[float]]:
    turn = np.linspace(0.0, 2 * np.pi, corners + 1)
    line = radius * np.column_stack([np.cos(turn), np.sin(turn)])
    line[-1] = line[0]
    return [list(corner) for corner in line.tolist()]


def polygon(*lines: list[list[float]]) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": list(lines)}


def written(folder: Path, content: object) -> str:
    path = folder / "lines.geojson"
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return str(path)


def inside(folder: Path, points: Floats, content: object, **changes: object) -> Report:
    outline = written(folder, content)
    return divespot.measure(points, {"outline": outline, **changes})


def test_geojson_may_be_given_as_a_dict(tmp_path: Path) -> None:
    by_dict = divespot.measure(cone(), outline=polygon(square(0.6)))
    assert by_dict.piles == inside(tmp_path, cone(), polygon(square(0.6))).piles
    again = divespot.measure(cone(), json.loads(by_dict.to_json())["settings"])
    assert again.piles == by_dict.piles
    assert by_dict.inputs == (None, None, None)
    corners = tuple((np.float64(x), np.float32(y)) for x, y in np.array(square(0.5)))
    of_tuples = {"type": "Polygon", "coordinates": (corners,)}
    assert divespot.measure(cone(), outline=of_tuples).piles[0].footprint_m2 == pytest.approx(1.0)
    with pytest.raises(DivespotError, match=r"^outline is {.*}: a path, or GeoJSON as a dict, is"):
        divespot.measure(cone(), outline={"type": object()})
    with pytest.raises(DivespotError, match=r"^outline: outline 1 is Point: Polygon or MultiPol"):
        divespot.measure(cone(), outline={"type": "Point", "coordinates": [0, 0]})
    far = polygon([[x + 99, y] for x, y in square(0.6)])
    with pytest.raises(DivespotError, match=r"^outline: .* needed$"):
        divespot.measure(cone(), outline=far)


def volume_m3(report: Report) -> float:
    (pile,) = report.piles
    return pile.volume_m3


@pytest.mark.parametrize("half", [0.6, 0.7113])
def test_a_cone_is_whole_inside_any_line_around_it(half: float, tmp_path: Path) -> None:
    report = inside(tmp_path, cone(), polygon(square(half)))
    assert volume_m3(report) == pytest.approx(SOLIDS["cone"].volume_m3, rel=1e-3)
    (pile,) = report.piles
    assert pile.footprint_m2 == pytest.approx(4 * half**2, rel=1e-9)
    assert (pile.seen_fraction, pile.touches_edge, pile.base_from) == (1, False, "annulus")
    np.testing.assert_allclose(np.array(pile.outline_m)[:, :2], square(half)[:-1], atol=1e-9)


@pytest.mark.parametrize("radius", [0.11, 0.2, 0.317])
def test_a_circle_cuts_a_cone_where_it_runs(radius: float, tmp_path: Path) -> None:
    report = inside(tmp_path, cone(), polygon(circle(radius)), base="height=0")
    # z = 1/4 - r/2; a polygon of 200 corners has 2 in 10,000 less.
    truth = np.pi * radius**2 * (1 / 4 - radius / 3)
    assert volume_m3(report) == pytest.approx(truth, rel=1.5e-3)


def test_a_wedge_is_cut_exactly(tmp_path: Path) -> None:
    line = [[0.3011, -0.4], [0.8207, -0.3], [0.5, 0.7013], [0.3011, -0.4]]
    report = inside(tmp_path, wedge(), polygon(line), base="height=0", up="z")
    a, b, c = (np.array(corner) for corner in line[:3])
    area = 0.5 * abs((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
    # The mean height of a plane over a triangle is that at its centroid.
    truth = area * (a + b + c)[0] / 3 / 4
    assert report.ground.normal[2] > 0.999
    assert volume_m3(report) == pytest.approx(truth, rel=2e-3)


def test_a_box_without_a_floor_is_cut_along_up_however_its_surface_lies(tmp_path: Path) -> None:
    x, y = raster(80, 72, STEP_M)
    line = [[-0.4, -0.3], [0.5, -0.3], [0.5, 0.4], [-0.4, 0.4], [-0.4, -0.3]]
    for slope in (0.05, 0.2, 0.5):
        points = np.column_stack([x, y, 1.0 + slope * x])
        report = inside(tmp_path, points, polygon(line), base="height=0", up="z")
        assert volume_m3(report) == pytest.approx(0.9 * 0.7 * (1.0 + slope * 0.05), rel=1e-6)
        assert report.ground.normal == (0, 0, 1)


def test_a_hole_stays_out(tmp_path: Path) -> None:
    whole = inside(tmp_path, cone(), polygon(square(0.6)))
    holed = inside(tmp_path, cone(), polygon(square(0.6), square(0.1)))
    # Mean distance from the middle of a square of edge 1: 0.38260.
    core = 0.04 * (1 / 4 - 0.2 * 0.38260 / 2)
    assert volume_m3(whole) - volume_m3(holed) == pytest.approx(core, rel=0.01)
    turned = inside(tmp_path, cone(), polygon(square(0.6)[::-1], square(0.1)[::-1]))
    assert volume_m3(turned) == pytest.approx(volume_m3(holed), rel=1e-12)


def test_parts_of_one_feature_are_one_row_and_features_are_rows_with_names(tmp_path: Path) -> None:
    halves = [
        [[[-0.6, s * 0.6], [0.6, s * 0.6], [0.6, 0], [-0.6, 0], [-0.6, s * 0.6]]] for s in (-1, 1)
    ]
    both = {"type": "MultiPolygon", "coordinates": halves}
    report = inside(tmp_path, cone(), both)
    assert volume_m3(report) == pytest.approx(SOLIDS["cone"].volume_m3, rel=1e-3)
    features = [
        {"type": "Feature", "properties": {"name": "south"}, "geometry": polygon(*halves[0])},
        {"type": "Feature", "id": 7, "properties": None, "geometry": polygon(*halves[1])},
    ]
    report = inside(tmp_path, cone(), {"type": "FeatureCollection", "features": features})
    assert {pile.name for pile in report.piles} == {"south", "7"}
    assert report.total.volume_m3 == pytest.approx(SOLIDS["cone"].volume_m3, rel=1e-3)
    assert json.loads(report.to_json())["piles"][0]["name"] in ("south", "7")


def test_the_base_comes_from_the_ring_outside(tmp_path: Path) -> None:
    slope = cone() + np.column_stack([np.zeros((len(cone()), 2)), 0.05 * cone()[:, 0] + 0.3])
    report = inside(tmp_path, slope, polygon(square(0.6)))
    assert volume_m3(report) == pytest.approx(SOLIDS["cone"].volume_m3, rel=2e-3)


def test_far_from_the_origin_and_in_feet_it_is_the_same(tmp_path: Path) -> None:
    near = inside(tmp_path, cone(), polygon(square(0.6113)))
    line = (np.array(square(0.6113)) + UTM_M[:2]).tolist()
    far = inside(tmp_path, cone() + UTM_M, polygon(line))
    assert volume_m3(far) == pytest.approx(volume_m3(near), rel=1e-8)
    line = (np.array(square(0.6113)) / 0.3048).tolist()
    feet = inside(tmp_path, cone() / 0.3048, polygon(line), unit="ft")
    assert volume_m3(feet) == pytest.approx(volume_m3(near), rel=1e-6)


def test_a_tilted_scan_is_cut_along_its_ground_s_normal(tmp_path: Path) -> None:
    sin, cos = np.sin(np.radians(20)), np.cos(np.radians(20))
    turn = np.array([[1, 0, 0], [0, cos, -sin], [0, sin, cos]])
    line = np.column_stack([square(0.6), np.zeros(5)]) @ turn.T
    report = inside(tmp_path, cone() @ turn.T, polygon(line[:, :2].tolist()))
    assert volume_m3(report) == pytest.approx(SOLIDS["cone"].volume_m3, rel=1e-3)
    assert report.piles[0].footprint_m2 == pytest.approx(1.44, rel=1e-6)


def test_a_camera_s_frame_needs_the_third_coordinate(tmp_path: Path) -> None:
    line = np.column_stack([square(0.6), np.zeros(5)])[:, [0, 2, 1]]
    optical = cone()[:, [0, 2, 1]] * [1, -1, 1]
    report = inside(tmp_path, optical, polygon(line.tolist()))
    assert volume_m3(report) == pytest.approx(SOLIDS["cone"].volume_m3, rel=1e-3)
    with pytest.raises(DivespotError, match=r"outline 1 has x and y only.* z are needed"):
        inside(tmp_path, optical, polygon(line[:, :2].tolist()))


def test_a_line_that_runs_out_of_the_scan_is_flagged(tmp_path: Path) -> None:
    report = inside(tmp_path, cone(), polygon(square(0.8, (1.25, 0))))
    (pile,) = report.piles
    assert pile.touches_edge
    assert pile.seen_fraction == pytest.approx(0.5, abs=0.02)
    assert any("runs out of the scan" in warning for warning in report.warnings)


def test_what_was_found_can_be_measured_again_inside_its_outline(tmp_path: Path) -> None:
    points = sampled(SOLIDS["frustum"], STEP_M, (1.25, 1.125)) + UTM_M
    found = divespot.measure(points)
    path = tmp_path / "found.geojson"
    divespot.save_outlines(found, path)
    again = divespot.measure(points, outline=path)
    assert volume_m3(again) == pytest.approx(volume_m3(found), rel=0.01)
    assert again.piles[0].name is None
    assert volume_m3(again) == pytest.approx(volume_m3(found), abs=0.2 * found.piles[0].u95_m3)
    # The line runs around the cells of the toe, too.
    assert again.piles[0].footprint_m2 > found.piles[0].footprint_m2
    with pytest.raises(DivespotError, match="cannot be written"):
        divespot.save_outlines(found, tmp_path / "none" / "x.geojson")


BAD: dict[str, tuple[object, str]] = {
    "no JSON": ("{", "is no JSON"),
    "a list": ([1, 2], "outline 1 is no geometry: Polygon or MultiPolygon is needed"),
    "a point": ({"type": "Point", "coordinates": [0, 0]}, "is Point: Polygon or"),
    "nothing": ({"type": "FeatureCollection", "features": []}, "holds no feature"),
    "no geometry": ({"type": "Feature", "geometry": None}, "outline 1 is no geometry"),
    "no lines": ({"type": "Polygon", "coordinates": []}, "has no lines"),
    "not closed": (polygon(square(0.6)[:-1]), "outline 1 is not closed"),
    "a bow": (polygon([[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]), "crosses itself after"),
    "a line": (polygon([[0, 0], [1, 1], [0.5, 0.5], [0, 0]]), "has no area"),
    "words": ({"type": "Polygon", "coordinates": [[["a", "b"]] * 4]}, "no proper positions"),
    "lengths": (polygon([[0, 0], [1, 0, 1], [1, 1], [0, 0]]), "no proper positions"),
    "infinity": (polygon([[0, 0], [1e999, 0], [1, 1], [0, 0]]), "not finite"),
    "elsewhere": (polygon(square(0.5, (40, 0))), "outline 1 lies where the scan saw nothing"),
    "twice": (
        {"type": "MultiPolygon", "coordinates": [[square(0.6)], [square(0.5)]]},
        "an area that is covered once is needed",
    ),
    "hole outside": (polygon(square(0.3), square(0.1, (0.6, 0))), "or a hole outside"),
}


@pytest.mark.parametrize("name", BAD)
def test_files_that_are_no_outlines_give_one_sentence(name: str, tmp_path: Path) -> None:
    content, message = BAD[name]
    with pytest.raises(DivespotError, match=message) as caught:
        inside(tmp_path, cone(), content)
    assert str(caught.value).startswith(str(tmp_path))
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(DivespotError, match=r"none.geojson: cannot be read"):
        divespot.measure(cone(), outline=tmp_path / "none.geojson")
    (tmp_path / "latin.geojson").write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(DivespotError, match="is no JSON"):
        divespot.measure(cone(), outline=tmp_path / "latin.geojson")


def test_outlines_and_bases_go_together(tmp_path: Path) -> None:
    report = inside(tmp_path, cone(), polygon(square(0.6)), compare_bases=True, material="wheat")
    volumes = report.piles[0].volume_by_base_m3 or {}
    assert all(v == pytest.approx(SOLIDS["cone"].volume_m3, rel=0.015) for v in volumes.values())
    assert (report.piles[0].mass_kg or 0) == pytest.approx(774 * volumes["local"], rel=1e-9)


def test_outlines_that_overlap_are_refused_neighbours_are_not(tmp_path: Path) -> None:
    def features(*places: tuple[float, float]) -> dict[str, Any]:
        squares = [{"type": "Feature", "geometry": polygon(square(0.25, at))} for at in places]
        return {"type": "FeatureCollection", "features": squares}

    report = inside(tmp_path, cone(), features((-0.25, 0), (0.25, 0), (0.2, 0.505)))
    assert len(report.piles) + len(report.other_objects) == 3
    for place in ((0.2, 0.1), (-0.25, 0), (0.0, 0.0)):
        with pytest.raises(DivespotError, match="outline 1 and outline 2 overlap"):
            inside(tmp_path, cone(), features((-0.25, 0), place))


def test_a_wgs84_outline_over_a_projected_scan_is_named(tmp_path: Path) -> None:
    degrees = polygon(square(1e-5, (8.73, 49.26)))
    with pytest.raises(DivespotError, match=r"longitude and latitude \(WGS 84\)"):
        inside(tmp_path, cone() + UTM_M, degrees)


@pytest.mark.parametrize("spike", [0.0, 0.01])
def test_the_time_of_an_outline_grows_with_its_corners(tmp_path: Path, spike: float) -> None:
    frame = inside(tmp_path, cone(), polygon(square(0.6))).level.frame

    def seconds(corners: int) -> float:
        turn = np.linspace(0.0, 2 * np.pi, corners, endpoint=False)
        radius = 0.6 + spike * (np.arange(corners) % 2)
        line = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)]).tolist()
        path = written(tmp_path, polygon([*line, line[0]]))
        taken = []
        for _ in range(3):
            begin = time.process_time()
            assert len(read_regions(path, frame)[0].rings[0]) == corners
            taken.append(time.process_time() - begin)
        return min(taken)

    # Sixteen times as many corners: of all pairs there would be 256 times as many.
    assert seconds(80_000) < 64.0 * seconds(5_000)


@pytest.mark.skipif(os.name == "nt", reason="no pipes with a name")
def test_a_pipe_and_a_file_as_large_as_a_disk_are_no_outlines(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.geojson")
    with (tmp_path / "sparse.geojson").open("wb") as file:
        file.truncate(1 << 40)
    for name, words in (("pipe", "no regular file"), ("sparse", "at most 256 MB")):
        with pytest.raises(DivespotError, match=words):
            divespot.measure(cone(), outline=tmp_path / f"{name}.geojson")
        with pytest.raises(DivespotError, match=r"no regular file|at most .* MB are needed"):
            divespot.measure(cone(), base=f"surface={tmp_path / name}.geojson")


def against_a_wall() -> Floats:
    """Return half a cone against a wall of 1 m at x = 0, and the top of that wall."""
    rng = np.random.default_rng(4)
    x, y = rng.uniform(-1.2, 0.0, 40_000), rng.uniform(-1.0, 1.0, 40_000)
    heap = np.column_stack([x, y, np.clip(0.35 - 0.6 * np.hypot(x, y), 0, None)])
    face = np.column_stack(
        [np.zeros(20_000), rng.uniform(-1, 1, 20_000), rng.uniform(0, 1, 20_000)]
    )
    face = face[face[:, 2] > 0.35 - 0.6 * abs(face[:, 1])]
    top = np.column_stack([*rng.uniform((0.0, -1.0), (0.1, 1.0), (3_000, 2)).T, np.ones(3_000)])
    points = np.concatenate([heap, face, top])
    return np.asarray(points + rng.normal(0, 0.001, points.shape))


@pytest.mark.parametrize("ends_m", [0.0, 0.03, 0.09])
def test_an_outline_on_or_beyond_a_wall_gives_the_same(ends_m: float, tmp_path: Path) -> None:
    line = [[-0.8, -0.8], [ends_m, -0.8], [ends_m, 0.8], [-0.8, 0.8], [-0.8, -0.8]]
    (pile,) = inside(tmp_path, against_a_wall(), polygon(line)).piles
    truth = np.pi / 2 * (0.35 / 0.6) ** 2 * 0.35 / 3
    assert abs(pile.volume_m3 - truth) < max(pile.u95_m3, 0.01 * truth)
    assert pile.u95_m3 < 0.05 * truth


# A rectangle


@pytest.mark.parametrize("up", [np.zeros(3), UTM_M])
def test_a_rectangle_is_an_outline(up: Floats, tmp_path: Path) -> None:
    half, (x, y) = 0.6, up[:2]
    lines = [[a + dx, b + dy] for (a, b), (dx, dy) in (((x, y), corner) for corner in square(half))]
    by_file = inside(tmp_path, cone() + up, polygon(lines))
    by_option = divespot.measure(cone() + up, inside=(x - half, y - half, x + half, y + half))
    assert by_option.total == by_file.total
    assert volume_m3(by_option) == pytest.approx(SOLIDS["cone"].volume_m3, rel=1e-3)


@pytest.mark.parametrize(
    ("box", "words"),
    [((0.0, 0.0, 0.0, 1.0), "no area"), ((50.0, 50.0, 51.0, 51.0), "inside")],
)
def test_rectangles_that_hold_nothing(box: tuple[float, ...], words: str) -> None:
    with pytest.raises(DivespotError, match=words):
        divespot.measure(cone(), inside=box)


def test_a_rectangle_or_outlines() -> None:
    with pytest.raises(DivespotError, match="one of them is needed"):
        Settings(outline="a.geojson", inside=(0.0, 0.0, 1.0, 1.0))
