"""What piles stand on, by name: against closed forms, and what is refused."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest

import divespot
from divespot import DivespotError, Pile, Settings, Stages
from divespot.base_name import PLAIN, BaseName
from divespot.io import write
from solids import SOLIDS, Floats, raster, sampled

if TYPE_CHECKING:
    from pathlib import Path


STEP_M = 2.0**-6
CONE_M3 = SOLIDS["cone"].volume_m3
UTM_M = np.array([482_310.0, 5_456_790.0, 312.0])


def noise(size: int, seed: int = 3) -> Floats:
    return np.round(np.random.default_rng(seed).normal(0, 0.001, size) * 2**20) / 2**20


def wavy(x: Floats, y: Floats) -> Floats:
    """Return a floor that wavers by 1 cm within the width of the pile."""
    return np.asarray(0.01 * np.sin(7 * x) * np.cos(6 * y))


@cache
def floor() -> Floats:
    x, y = raster(80, 72, STEP_M)
    return np.column_stack([x, y, np.round((wavy(x, y) + noise(x.size, 5)) * 2**20) / 2**20])


@cache
def heap() -> Floats:
    """Return a cone on the wavy floor."""
    x, y = raster(80, 72, STEP_M)
    z = SOLIDS["cone"].height_m(x, y) + wavy(x, y) + noise(x.size)
    return np.column_stack([x, y, np.round(z * 2**20) / 2**20])


@cache
def cone() -> Floats:
    points = sampled(SOLIDS["cone"], STEP_M, (1.25, 1.125))
    return points + np.column_stack([np.zeros((len(points), 2)), noise(len(points))])


def pile(points: Floats, base: str, **changes: object) -> Pile:
    (found,) = divespot.measure(points, {"base": base, **changes}).piles
    return found


def saved(folder: Path, points: Floats, name: str = "floor.ply") -> str:
    write(folder / name, points)
    return f"surface={folder / name}"


@pytest.mark.parametrize("base", [*PLAIN, "height=0", "camera-height=0.0"])
def test_on_a_level_floor_all_bases_agree(base: str) -> None:
    if base == "camera-height=0.0":
        points, base = cone() - [0, 0, 1.5], "camera-height=1.5"
    else:
        points = cone()
    found = pile(points, base)
    # Points of the toe lift the fitted plane.
    within = 0.01 if base == "plane" else 0.005
    assert found.volume_m3 == pytest.approx(CONE_M3, rel=within)
    assert abs(found.volume_m3 - CONE_M3) < 1.5 * found.u95_m3
    assert found.base == base.partition("=")[0]
    assert found.base_from == ("annulus" if base == "local" else None)


def test_a_height_is_one_in_the_scan_s_own_frame() -> None:
    one, other = pile(cone() + UTM_M, "height=312"), pile(cone() + UTM_M, "height=311.98")
    assert one.volume_m3 == pytest.approx(CONE_M3, rel=0.005)
    under_m2 = (other.volume_m3 - one.volume_m3) / 0.02
    assert other.footprint_m2 * 0.9 < under_m2 < 2 * other.footprint_m2
    feet = pile((cone() + UTM_M) / 0.3048, f"height={312 / 0.3048}", unit="ft")
    assert feet.volume_m3 == pytest.approx(one.volume_m3, rel=1e-6)


def test_a_height_is_level_to_up_whatever_the_floor_s_tilt() -> None:
    points = cone()
    # A floor that falls by 3 cm a metre: less stands above the level through its middle downhill.
    tilted = points + np.column_stack([np.zeros((len(points), 2)), 0.03 * points[:, 0]])
    along, level = pile(tilted, "plane"), pile(tilted, "height=0")
    assert along.fill_m3 < 0.01 * CONE_M3 < level.fill_m3
    assert level.volume_m3 == pytest.approx(along.volume_m3, rel=0.01)
    given = pile(points[:, [1, 2, 0]], "height=0.0", up="y")
    assert given.volume_m3 == pytest.approx(CONE_M3, rel=0.005)


def test_a_camera_s_height_needs_no_level_scan() -> None:
    # The camera looks along z, the floor is 1.4 m before it and tilted by 20°.
    sin, cos = np.sin(np.radians(20)), np.cos(np.radians(20))
    turn = np.array([[1, 0, 0], [0, -cos, sin], [0, -sin, -cos]])
    seen = (cone() - [0, 0, 1.4]) @ turn.T
    found = pile(seen, "camera-height=1.4")
    assert found.volume_m3 == pytest.approx(CONE_M3, rel=0.005)
    millimetres = pile(seen * 1000, "camera-height=1400", unit="mm")
    assert millimetres.volume_m3 == pytest.approx(found.volume_m3, rel=1e-6)


def test_the_midpoint_of_the_peaks_lies_between_two_levels() -> None:
    # Stripes of two levels, 2 cm apart: their peaks take turns at being the highest.
    stripes = np.mod(cone()[:, 0] / 0.15, 1) < 0.6
    split = cone() + np.outer(stripes, [0, 0, 0.02])
    peak, middle = pile(split, "peak"), pile(split, "midpeak")
    assert middle.volume_m3 == pytest.approx(CONE_M3, rel=0.06)
    assert peak.volume_m3 != pytest.approx(CONE_M3, rel=0.1)
    paper = divespot.measure(split, Settings.paper(base="midpeak")).piles[0]
    assert paper.base == "midpeak"


def test_an_earlier_scan_takes_its_waves_off(tmp_path: Path) -> None:
    found = pile(heap(), saved(tmp_path, floor()))
    assert found.volume_m3 == pytest.approx(CONE_M3, rel=0.004)
    assert abs(found.volume_m3 - CONE_M3) < found.u95_m3
    assert found.base == "surface"
    plane = pile(heap(), "plane")
    assert abs(found.volume_m3 - CONE_M3) < 0.5 * abs(plane.volume_m3 - CONE_M3)


def test_an_earlier_scan_far_from_the_origin_turned_and_in_feet(tmp_path: Path) -> None:
    near = pile(heap(), saved(tmp_path, floor()))
    far = pile(heap() + UTM_M, saved(tmp_path, floor() + UTM_M))
    assert far.volume_m3 == pytest.approx(near.volume_m3, rel=1e-8)
    feet = pile(heap() / 0.3048, saved(tmp_path, floor() / 0.3048), unit="ft")
    assert feet.volume_m3 == pytest.approx(near.volume_m3, rel=1e-3)
    flipped = pile(heap() * [1, -1, -1], saved(tmp_path, floor() * [1, -1, -1]), up="-z")
    assert flipped.volume_m3 == pytest.approx(near.volume_m3, rel=1e-3)


def test_other_points_on_the_earlier_floor_do(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1.25, 1.25, 30_000), rng.uniform(-1.1, 1.1, 30_000)
    rough = np.column_stack([x, y, wavy(x, y) + rng.normal(0, 0.001, x.size)])
    found = pile(heap(), saved(tmp_path, rough))
    assert found.volume_m3 == pytest.approx(CONE_M3, rel=0.005)


def test_where_the_earlier_scan_saw_nothing_is_said_and_paid_for(tmp_path: Path) -> None:
    hole = np.hypot(*floor().T[:2]) < 0.3
    base = saved(tmp_path, floor()[~hole])
    report = divespot.measure(heap(), base=base)
    assert any("the base has no data below" in warning for warning in report.warnings)
    found, whole = report.piles[0], pile(heap(), saved(tmp_path, floor(), "all.ply"))
    assert found.budget.base_m3 > 3 * whole.budget.base_m3
    assert abs(found.volume_m3 - CONE_M3) < found.u95_m3


def test_all_that_differs_counts_also_the_ground_itself(tmp_path: Path) -> None:
    report = divespot.measure(heap(), base=saved(tmp_path, floor() - [0, 0, 0.05]))
    assert any("runs out of the scan" in warning for warning in report.warnings)
    whole_m3 = CONE_M3 + 0.05 * 160 * 144 * STEP_M**2
    assert sum(p.volume_m3 for p in report.piles) == pytest.approx(whole_m3, rel=0.01)


@pytest.mark.parametrize("suffix", [".ply", ".npy", ".xyz"])
def test_a_saved_base_measures_the_same(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"base{suffix}"
    report = divespot.measure(heap() + UTM_M)
    divespot.save_base(report, path)
    again = pile(heap() + UTM_M, f"surface={path}")
    assert again.volume_m3 == pytest.approx(report.piles[0].volume_m3, rel=1e-3)


@pytest.mark.parametrize("base", ["plane", "midpeak"])
def test_waves_differ_from_a_saved_plane(base: str, tmp_path: Path) -> None:
    report = divespot.measure(heap(), base=base)
    divespot.save_base(report, tmp_path / "base.ply")
    piles = divespot.measure(heap(), base=f"surface={tmp_path / 'base.ply'}").piles
    assert min(p.volume_m3 for p in piles) < 0.0
    # Waves cancel over the whole floor.
    assert sum(p.volume_m3 for p in piles) == pytest.approx(CONE_M3, rel=0.1)


def test_a_saved_surface_is_itself(tmp_path: Path) -> None:
    report = divespot.measure(heap(), base=saved(tmp_path, floor()))
    divespot.save_base(report, tmp_path / "again.npy")
    again = pile(heap(), f"surface={tmp_path / 'again.npy'}")
    assert again.volume_m3 == pytest.approx(report.piles[0].volume_m3, rel=1e-3)


def test_a_base_saved_in_feet_is_read_in_feet(tmp_path: Path) -> None:
    report = divespot.measure(heap() / 0.3048, unit="ft")
    divespot.save_base(report, tmp_path / "base.ply")
    again = pile(heap() / 0.3048, f"surface={tmp_path / 'base.ply'}", unit="ft")
    assert again.volume_m3 == pytest.approx(report.piles[0].volume_m3, rel=1e-3)


def test_bases_side_by_side_are_those_one_by_one() -> None:
    report = divespot.measure(heap(), base="height=0.001", compare_bases=True)
    volumes = report.piles[0].volume_by_base_m3 or {}
    assert list(volumes) == [*PLAIN, "height=0.001"]
    assert volumes["height=0.001"] == report.piles[0].volume_m3
    for name in ("local", "plane", "peak"):
        assert volumes[name] == pile(heap(), name).volume_m3
    assert pile(heap(), "local").volume_by_base_m3 is None
    doubled = divespot.measure(heap(), compare_bases=True, stages=Stages(factor=2.0)).piles[0]
    assert (doubled.volume_by_base_m3 or {})["local"] == doubled.volume_m3


def test_what_stands_there_does_not_depend_on_the_base() -> None:
    for base in ("height=-0.4", "height=0.1", "plane"):
        assert len(divespot.measure(cone(), base=base).piles) == 1
    assert not divespot.measure(sampled(SOLIDS["box"], STEP_M), base="height=0.1").piles


def test_orders_and_threads_change_no_bit(tmp_path: Path) -> None:
    base = saved(tmp_path, floor())
    order = np.random.default_rng(0).permutation(len(heap()))
    expected = pile(heap(), base)
    assert pile(heap()[order], saved(tmp_path, floor()[order], "b.ply"), threads=1) == expected


@pytest.mark.parametrize(
    ("base", "message"),
    [
        ("height=312", r"312 m above the ground of a scan of .* m, a height in the scan's own"),
        ("camera-height=400", "below the ground of a scan"),
        ("surface=none.ply", "none.ply: cannot be read"),
    ],
)
def test_bases_that_cannot_be_are_refused(base: str, message: str) -> None:
    with pytest.raises(DivespotError, match=message):
        divespot.measure(cone(), base=base)


def test_surfaces_that_cannot_be_are_refused(tmp_path: Path) -> None:
    elsewhere = saved(tmp_path, floor() + np.array([50.0, 0, 0]))
    with pytest.raises(DivespotError, match=r"floor.ply: 0 usable points .* that overlaps"):
        divespot.measure(heap(), base=elsewhere)
    few = saved(tmp_path, floor()[:3], "few.ply")
    with pytest.raises(DivespotError, match=r"few.ply: .* points .* needed|few.ply: .* needs"):
        divespot.measure(heap(), base=few)
    (tmp_path / "text.ply").write_text("no scan")
    with pytest.raises(DivespotError, match=r"text\.ply: it is no PLY"):
        divespot.measure(heap(), base=f"surface={tmp_path / 'text.ply'}")


def test_a_height_across_the_ground_is_refused() -> None:
    with pytest.raises(DivespotError, match="from level to up, at most 60°"):
        divespot.measure(cone(), base="height=0", up="1,0,0.3", max_tilt_deg=89.0)


def test_bases_are_saved_where_they_can_be(tmp_path: Path) -> None:
    report = divespot.measure(cone())
    with pytest.raises(
        DivespotError, match=r"one of \.ply, \.npy, \.xyz is needed as the ending of a base"
    ):
        divespot.save_base(report, tmp_path / "base.las")
    with pytest.raises(DivespotError, match="cannot be written"):
        divespot.save_base(report, tmp_path / "none" / "base.ply")


def test_names_are_read_as_typed() -> None:
    assert BaseName.parse("surface=a=b.ply") == BaseName("surface", path="a=b.ply")
    parsed = BaseName.parse("height=-0.5")
    assert parsed is not None
    assert (parsed.kind, parsed.height) == ("height", -0.5)
    assert [BaseName.parse(text) for text in ("", "sea", "peak=1", "height=nan")] == [None] * 4
    with pytest.raises(DivespotError, match=r"base is 'sea': one of local, plane, .*surface=FILE"):
        Settings(base="sea")
