"""The settings: names, defaults, presets, and lengths that follow from the scan."""

from __future__ import annotations

import json
from dataclasses import asdict, fields, replace
from typing import Any

import numpy as np
import pytest

import divespot
from divespot import DivespotError, Settings, Stages
from divespot._typed import Changes, PaperChanges, StageChanges
from divespot.settings import NAMES, STAGE_NAMES
from reports import objects, result
from solids import SOLIDS, sampled

CONE = sampled(SOLIDS["cone"], 2.0**-6)
LENGTHS = [name for name in (*NAMES, *STAGE_NAMES) if name.endswith("_m")]


def values(settings: Settings) -> dict[str, Any]:
    """Return all settings by name, those of the stages among them."""
    found = asdict(settings)
    inner: dict[str, Any] = found.pop("stages")
    return found | inner


@pytest.mark.parametrize("scale", [2.0**-10, 0.5, 4.0, 1024.0])
def test_lengths_go_with_the_scan(scale: float) -> None:
    one, other = (values(divespot.measure(CONE * by).settings) for by in (1.0, scale))
    for name in LENGTHS:
        assert other[name] == scale * one[name]
    same = set(one) - set(LENGTHS)
    assert {name: one[name] for name in same} == {name: other[name] for name in same}


def test_a_finer_scan_has_finer_cells() -> None:
    coarse, fine = divespot.measure(CONE).settings, sampled(SOLIDS["cone"], 2.0**-7)
    finer = divespot.measure(fine).settings
    assert (coarse.cell_m, finer.cell_m) == (2.0**-5, 2.0**-6)
    assert (coarse.radius_m, finer.radius_m) == (4 * 2.0**-6, 4 * 2.0**-7)


@pytest.mark.parametrize("name", LENGTHS)
def test_a_length_that_is_given_stays(name: str) -> None:
    # Wider voxels would leave too few of the cone's floor to find ground on.
    length_m = 0.03125 if name == "voxel_m" else 0.0625
    changes: Any = {name: length_m}
    report = divespot.measure(CONE, Settings().tuned(**changes))
    assert values(report.settings)[name] == length_m


def test_nothing_is_open_in_a_report() -> None:
    found = values(divespot.measure(CONE).settings)
    open_ = {name for name, value in found.items() if value is None}
    assert open_ == {
        "classes",
        "columns",
        "crop",
        "crs",
        "density_kg_m3",
        "inside",
        "material",
        "outline",
    }


def test_the_settings_of_a_report_measure_the_same_again() -> None:
    report = divespot.measure(CONE)
    assert result(divespot.measure(CONE, report.settings)) == result(report)


def test_settings_and_single_settings_mean_the_same() -> None:
    by_name = divespot.measure(CONE, cell_m=0.05, seed=3)
    assert result(divespot.measure(CONE, Settings(cell_m=0.05, seed=3))) == result(by_name)
    assert result(divespot.measure(CONE, Settings(cell_m=0.05), seed=3)) == result(by_name)


def test_unknown_names_are_refused_beside_settings_too() -> None:
    with pytest.raises(DivespotError, match=r"unknown setting 'cell': one of .*cell_m.* is needed"):
        Settings().changed(cell=0.1)  # type: ignore[call-arg]
    with pytest.raises(DivespotError, match="unknown setting 'cell'"):
        Settings.paper(cell=0.1)  # type: ignore[call-arg]


def test_every_setting_has_a_text_for_people() -> None:
    for record in (Settings, Stages):
        doc = " ".join((record.__doc__ or "").split())
        for item in fields(record):
            assert len(item.metadata["help"]) > 10
            takes = item.metadata["needed"].rstrip(",")
            assert f"{item.metadata['help'][1:]}. Takes {takes}. Default: " in doc


def test_the_instrument_has_about_twenty_settings() -> None:
    assert len(set(NAMES) - {"stages"}) <= 22


def test_the_typed_keywords_are_the_settings() -> None:
    assert Changes.__annotations__.keys() == {*NAMES}
    assert PaperChanges.__annotations__.keys() == {*NAMES, *STAGE_NAMES}
    for record, typed in ((Settings, Changes), (Stages, StageChanges)):
        wanted = {item.name: item.type for item in fields(record)}
        given = {name: kind.__forward_arg__ for name, kind in typed.__annotations__.items()}
        assert given == wanted


@pytest.mark.parametrize("name", STAGE_NAMES)
def test_a_parameter_of_the_paper_says_where_it_is_taken(name: str) -> None:
    changes: Any = {name: 1}
    with pytest.raises(DivespotError, match=rf"^{name} is no setting .* Settings.paper\({name}="):
        divespot.measure(CONE, **changes)


@pytest.mark.parametrize("name", ["method", "inner_voxel_m", "slice_m", "slice_contour", "alpha_m"])
def test_a_volume_method_says_where_it_went(name: str) -> None:
    with pytest.raises(
        DivespotError, match=r"^\w+ is no .* divespot\.volume\.volumes_m3 is needed"
    ):
        divespot.measure(CONE, {name: "hull"})


def test_a_renamed_parameter_says_its_name() -> None:
    with pytest.raises(
        DivespotError, match=r"^ring_share is no setting .*: annulus_share is needed"
    ):
        divespot.Settings.paper(ring_share=0.2)  # type: ignore[call-arg]


def test_settings_may_be_a_dict_as_of_a_report() -> None:
    report = divespot.measure(CONE, crop=(-9, -9, -9, 9, 9, 9), up=(0, 0, 2.5))
    assert report.settings.up == (0.0, 0.0, 2.5)
    by_dict = divespot.measure(CONE, json.loads(report.to_json())["settings"])
    assert result(by_dict) == result(report)
    assert divespot.measure(CONE, {"cell_m": 0.05}, seed=3).settings.cell_m == 0.05
    assert Settings(stages={"window": 3}) == Settings(stages=Stages(window=3))  # type: ignore[arg-type]
    with pytest.raises(DivespotError, match=r"stages is {.*}: a divespot\.Stages, or a dict"):
        divespot.measure(CONE, {"stages": {"cell_m": 1}})


def test_up_may_be_three_numbers() -> None:
    by_text = divespot.measure(CONE, up="0.0,0.0,-1.0")
    by_tuple = divespot.measure(CONE, up=(0, 0, -1))
    assert (by_tuple.piles, by_tuple.ground) == (by_text.piles, by_text.ground)


def test_settings_cannot_be_changed_afterwards() -> None:
    with pytest.raises(AttributeError):
        Settings().seed = 3  # type: ignore[misc]
    assert replace(Settings(), seed=3) == Settings(seed=3)


def test_the_paper_differs_by_settings_alone() -> None:
    paper = Settings.paper()
    ours, theirs = values(Settings()), values(paper)
    changed: Any = {name: value for name, value in theirs.items() if value != ours[name]}
    assert set(changed) == {
        *("scene_cluster", "voxel_m", "surface", "ground_form", "select", "base", "toe_m")
    }
    assert Settings.paper(seed=3) == replace(paper, seed=3)
    assert Settings.paper(window=3).stages == replace(paper.stages, window=3)
    assert Settings().tuned(**changed) == paper


def test_the_paper_cuts_the_toe_off() -> None:
    paper, ours = divespot.measure(CONE, Settings.paper()), divespot.measure(CONE)
    assert len(paper.piles) == 1
    assert paper.piles[0].base == "peak"
    assert 0.9 < paper.piles[0].volume_m3 / SOLIDS["cone"].volume_m3 < 1
    assert abs(ours.piles[0].volume_m3 / SOLIDS["cone"].volume_m3 - 1) < 1e-3


def test_the_paper_takes_the_largest_object_and_says_so() -> None:
    two = np.r_[CONE, CONE * [1, 1, 0.75] + [2, 0, 0]]
    assert len(divespot.measure(two).piles) == 2
    report = divespot.measure(two, Settings.paper())
    assert len(objects(report)) == 1
    assert any("largest of 2 objects" in warning for warning in report.warnings)


def test_factor_and_density_scale_their_results() -> None:
    plain = divespot.measure(CONE).piles[0]
    report = divespot.measure(
        CONE, stages=Stages(factor=1.5), density_kg_m3=720.0, density_u_kg_m3=36.0
    )
    pile = report.piles[0]
    assert pile.volume_m3 == pytest.approx(1.5 * plain.volume_m3, rel=1e-12)
    assert pile.u95_m3 == pytest.approx(1.5 * plain.u95_m3, rel=1e-12)
    assert pile.mass_kg == pytest.approx(720 * pile.volume_m3, rel=1e-12)
    expected = np.hypot(pile.u95_m3 / pile.volume_m3, 2 * 0.05) * (pile.mass_kg or 0)
    assert pile.u95_mass_kg == pytest.approx(expected, rel=1e-12)


def test_a_material_has_the_spread_of_its_density() -> None:
    report = divespot.measure(CONE, material="corn")
    corn = divespot.MATERIALS["corn"]
    low, high = corn.density_range_kg_m3
    assert report.settings.density_kg_m3 == corn.density_kg_m3 == pytest.approx(721)
    assert report.settings.density_u_kg_m3 == pytest.approx((high - low) / 12**0.5)
    assert low < 721 - 36 < 721 + 36 < high
    assert result(divespot.measure(CONE, report.settings)) == result(report)


def test_a_density_that_is_given_counts_instead_of_the_material_s() -> None:
    report = divespot.measure(CONE, material="corn", density_kg_m3=700.0)
    assert (report.settings.density_kg_m3, report.settings.density_u_kg_m3) == (700, 0)
    assert any("taken as exact" in warning for warning in report.warnings)
    own = divespot.measure(CONE, material="corn", density_u_kg_m3=9.0).settings
    assert own.density_kg_m3 == pytest.approx(721)
    assert own.density_u_kg_m3 == 9


def test_the_total_is_weighed_as_one_volume() -> None:
    two = np.r_[CONE, CONE * [1, 1, 0.75] + [2, 0, 0]]
    report = divespot.measure(two, density_kg_m3=720.0, density_u_kg_m3=36.0)
    total, masses = report.total, [pile.mass_kg or 0.0 for pile in report.piles]
    assert total.mass_kg == pytest.approx(sum(masses), rel=1e-12)
    # The density is off for both alike.
    assert (total.u95_mass_kg or 0) > 0.1 * sum(masses)
    assert divespot.measure(two).total.mass_kg is None


def test_every_material_is_within_reason() -> None:
    for material in divespot.MATERIALS.values():
        low, high = material.density_range_kg_m3
        assert 300 < low < material.density_kg_m3 < high < 2000
        assert 0.02 < material.density_u_kg_m3 / material.density_kg_m3 < 0.05
        assert material.repose_deg is None or 20 < material.repose_deg[0] <= 45


def test_the_seed_is_reported_and_repeats() -> None:
    noise = np.random.default_rng(0).normal(0, 0.002, CONE.shape)
    one, again = (divespot.measure(CONE + noise, seed=12) for _ in range(2))
    assert one.seed == 12
    assert result(one) == result(again)
