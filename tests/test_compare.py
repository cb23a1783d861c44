"""Two surveys of a place: closed forms of what was gained and lost."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import Comparison, DivespotError
from divespot.cli import main
from divespot.comparing import _refuse_other_system
from divespot.results.alignment import align
from divespot.results.pile_matching import matched
from divespot.results.sideways import sideways
from test_differences import cone, cone_m3, noisy, plan, yard

if TYPE_CHECKING:
    from slow import Floats

SAME = ((-1.5, 1.5), 0.8, 0.5)
BEFORE = (((-1.5, -1.5), 0.9, 0.5), ((1.5, -1.5), 0.5, 0.3), SAME)
AFTER = (((-1.5, -1.5), 0.9, 0.2), ((1.5, -1.5), 0.9, 0.5), SAME, ((1.5, 1.5), 0.6, 0.4))
TRUTHS = [
    cone_m3(0.9, 0.5) - cone_m3(0.5, 0.3),
    cone_m3(0.6, 0.4),
    cone_m3(0.9, 0.2) - cone_m3(0.9, 0.5),
]


@cache
def scans(seed: int = 1) -> tuple[Floats, Floats]:
    return yard(seed, *BEFORE), yard(seed + 1, *AFTER)


def shifted(points: Floats, offset_m: float, slope: float) -> Floats:
    moved = points.copy()
    moved[:, 2] += offset_m + slope * moved[:, 0]
    return moved


@cache
def compared(offset_m: float = 0.0, slope: float = 0.0) -> Comparison:
    before, after = scans()
    return divespot.compare(shifted(before, offset_m, slope), after)


def test_a_survey_that_lies_beside_the_other_is_moved_back() -> None:
    before, after = scans()
    shift_m = (-0.08, 0.05)
    found = divespot.compare(before + np.array([*shift_m, 0.0]), after)
    beside = found.fit.sideways
    assert beside is not None
    assert found.aligned
    assert found.shift_m == pytest.approx((*shift_m, 0.0), abs=3 * beside.u_m)
    assert beside.u_m < 0.004
    assert len(found.places) == len(TRUTHS)
    for place, truth in zip(found.places, TRUTHS, strict=True):
        assert abs(place.net.volume_m3 - truth) < place.net.u95_m3
    assert any("so that unchanged piles coincide" in text for text in found.warnings)
    told = json.loads(found.to_json())["alignment"]
    assert told["shift_m"] == list(found.shift_m or ())


def test_where_every_pile_changed_x_and_y_are_taken_as_they_are() -> None:
    found = divespot.compare(yard(1, *BEFORE[:2]), yard(2, *AFTER[:2]))
    assert found.fit.sideways is None
    assert any("x and y were taken as they are" in text for text in found.warnings)
    assert json.loads(found.to_json())["alignment"]["shift_m"] is None


def test_a_ridge_tells_of_one_direction_alone() -> None:
    x, y = np.meshgrid(np.arange(60) * 0.1, np.arange(60) * 0.1)
    rng = np.random.default_rng(0)
    flat = np.zeros_like(x)
    stood = np.ones_like(x, dtype=np.bool_)
    noise = rng.normal(0.0, 0.005, x.shape)
    ridge = np.where(x < 3.0, 0.6, -0.6), flat
    assert sideways(0.02 * ridge[0] + noise, ridge, stood) is None
    heap = np.cos(x) * 0.6, np.sin(y) * 0.6
    found = sideways(0.02 * heap[0] - 0.01 * heap[1] + noise, heap, stood)
    assert found is not None
    assert found.shift_m == pytest.approx((0.02, -0.01), abs=3 * found.u_m)
    assert found.u_m < 0.005
    assert found.u_m3((0.0, 0.0)) == 0.0 < found.u_m3((1.0, 0.0))
    assert sideways(noise, heap, np.zeros_like(stood)) is None


@pytest.mark.parametrize(("offset_m", "slope"), [(0.0, 0.0), (0.05, 0.004)])
def test_what_changed_is_told_whatever_the_height_of_the_earlier_scan(
    offset_m: float, slope: float
) -> None:
    found = compared(offset_m, slope)
    assert found.aligned == (offset_m != 0.0)
    assert found.alignment.offset_m == pytest.approx(-offset_m, abs=0.001)
    assert len(found.places) == len(TRUTHS)
    for place, truth in zip(found.places, TRUTHS, strict=True):
        assert abs(place.net.volume_m3 - truth) < place.net.u95_m3
        assert place.net.volume_m3 == pytest.approx(place.gain_m3 - place.loss_m3)
        assert place.net.u95_m3 < 0.02 * abs(truth)
    for change, truth in (
        (found.gain, sum(TRUTHS[:2])),
        (found.loss, TRUTHS[2]),
        (found.net, sum(TRUTHS)),
    ):
        assert abs(change.volume_m3 - truth) < change.u95_m3
    assert found.alignment.detection_m == pytest.approx(1.96 * 0.0014, rel=0.2)


def test_piles_are_matched_where_they_lie_on_each_other() -> None:
    found = compared()
    assert [(one.before, one.after, one.state) for one in found.piles] == [
        ((3,), (1,), "in both"),
        ((2,), (2,), "in both"),
        ((1,), (3,), "in both"),
        ((), (4,), "new"),
    ]
    for one, truth in zip(found.piles, (TRUTHS[0], 0.0, TRUTHS[2], TRUTHS[1]), strict=True):
        assert abs(one.change.volume_m3 - truth) < one.change.u95_m3
    assert [place.piles for place in found.places] == [(1,), (4,), (3,)]
    assert [place.piles_before for place in found.places] == [(3,), (), (1,)]


def test_piles_that_part_and_grow_together_are_one_group() -> None:
    before, after = np.zeros((2, 20, 20), dtype=np.int64)
    before[2:8, 2:8] = 1  # parted
    after[2:8, 2:5] = 1
    after[2:8, 5:8] = 2
    before[12:18, 2:5] = 2  # grown together
    before[12:18, 5:8] = 3
    after[12:18, 2:8] = 3
    before[2:5, 12:15] = 4  # gone
    after[12:15, 12:15] = 4  # new
    after[5:6, 14:20] = 5  # a neighbour that shares a corner
    before[5:9, 18:20] = 5
    assert matched(before, after, (5, 5)) == [
        ((1,), (1, 2)),
        ((2, 3), (3,)),
        ((), (4,)),
        ((5,), (5,)),
        ((4,), ()),
    ]


def test_the_plane_of_stable_ground_is_found_though_some_of_it_changed() -> None:
    x, y = np.meshgrid(np.arange(120) * 0.1, np.arange(90) * 0.1)
    rng = np.random.default_rng(0)
    difference = 0.03 + 0.002 * (x - 6.0) - 0.001 * (y - 4.5) + rng.normal(0.0, 0.004, x.shape)
    difference[:30, :40] += 0.5
    difference[rng.random(x.shape) < 0.2] = np.nan
    found = align(difference, x, y)
    truth = 0.03 + 0.002 * (found.middle_m[0] - 6.0) - 0.001 * (found.middle_m[1] - 4.5)
    u = np.sqrt(np.diag(found.covariance))
    assert abs(found.offset_m - truth) < 4 * u[0] < 0.001
    assert abs(found.tilt[0] - 0.002) < 4 * u[1]
    assert abs(found.tilt[1] + 0.001) < 4 * u[2]
    assert found.u_m(*found.middle_m) == pytest.approx(u[0])
    assert found.u_m(100.0, 0.0) > 10 * u[0]


def test_with_too_little_ground_nothing_is_aligned() -> None:
    x, y = np.meshgrid(np.arange(30) * 0.1, np.arange(30) * 0.1)
    found = align(np.where((x < 0.3) & (y < 0.3), 0.5, np.nan), x, y)
    assert (found.offset_m, found.blocks) == (0.0, 0)
    assert np.isnan(align(np.full((9, 9), np.nan), x[:9, :9], y[:9, :9]).detection_m)


def test_heaps_that_fill_the_view_are_compared_as_surfaces() -> None:
    x, y = plan(9, (1.0, 0.8), 60_000)
    at = (0.1, 0.0)
    low, high = (
        noisy(seed, np.column_stack([x, y, cone(x, y, at, 2.5, height)]))
        for seed, height in ((1, 1.1), (2, 1.3))
    )
    found = divespot.compare(low, high, up="z")
    assert found.before is found.after is None
    assert not found.aligned
    assert found.piles == ()
    fine_x, fine_y = np.meshgrid(np.linspace(-1, 1, 801), np.linspace(-0.8, 0.8, 641))
    truth = 3.2 * cone(fine_x, fine_y, at, 2.5, 0.2).mean()
    assert found.net.volume_m3 == pytest.approx(truth, rel=0.02)
    assert sum("no ground is in view" in text for text in found.warnings) == 2
    assert any("too little ground" in text for text in found.warnings)
    assert json.loads(found.to_json())["detection_m"] is None


def test_what_differs_but_is_no_material_is_said() -> None:
    before, after = scans()
    box = np.random.default_rng(5).uniform((2.4, -0.3, 0.0), (2.8, 0.3, 0.4), (6000, 3))
    box[:, 2] = np.where(np.arange(6000) % 2, 0.4, box[:, 2])
    found = divespot.compare(before, np.concatenate([after, box]))
    assert any("not counted" in text for text in found.warnings)
    assert abs(found.net.volume_m3 - sum(TRUTHS)) < 2 * found.net.u95_m3


def test_other_coordinate_systems_are_refused() -> None:
    import dataclasses  # noqa: PLC0415

    source = compared().sources[0]
    systems = ("EPSG:25832", "EPSG:25833")
    one, other = (dataclasses.replace(source, crs=crs) for crs in systems)
    _refuse_other_system(one, one)
    _refuse_other_system(one, source)
    with pytest.raises(DivespotError, match="EPSG:25832, AFTER in EPSG:25833"):
        _refuse_other_system(one, other)


# The command


def run(*args: str | Path) -> tuple[int, str, str]:
    done = CliRunner().invoke(main, ["compare", *map(str, args)], prog_name="divespot")
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("compare")
    paths = folder / "before.npy", folder / "after.npy"
    for path, points in zip(paths, scans(), strict=True):
        np.save(path, points)
    return paths


def test_the_command_tells_what_python_does(files: tuple[Path, Path], tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    status, table, warned = run(*files, "--json", out)
    assert status == 0
    assert "x and y were taken" not in warned  # one pile stayed the same
    assert "new" in table
    assert "net: 0.24" in table
    found = json.loads(out.read_text(encoding="utf-8"))
    assert found["schema"] == "divespot.comparison/1"
    expected = json.loads(compared().to_json())
    for name in ("gain", "loss", "net", "piles", "places", "detection_m", "alignment"):
        assert found[name] == expected[name]
    assert found["before"]["source"]["path"] == str(files[0])
    assert {place["net"]["volume_m3"] > 0 for place in found["places"]} == {True, False}


def test_bad_input_is_one_line(files: tuple[Path, Path], tmp_path: Path) -> None:
    status, table, said = run(files[0], tmp_path / "none.ply")
    assert (status, table) == (1, "")
    assert "cannot be read" in said.splitlines()[-1]
    assert run(files[0], files[1], "--json", files[1])[0] == 1
    assert run(files[0])[0] == 2
    assert run(*files, "--show-unit", "pint")[0] == 2
    assert Path(files[1]).stat().st_size > 1000


def test_both_surveys_are_corrected_for_the_scale_of_their_map() -> None:
    pytest.importorskip("pyproj", reason="the extra crs is not installed")
    at = np.array([1_000_000.0, 6_200_000.0, 0.0])
    before, after = (points + at for points in scans())
    found = divespot.compare(before, after, crs="EPSG:3395")  # Mercator, metres of the map
    factor = found.sources[1].scale_factor or 0.0
    assert factor > 1.4
    truth = sum(TRUTHS) / factor**2
    assert abs(found.net.volume_m3 - truth) < found.net.u95_m3
