"""Several files as one survey: what they show together, and what they must agree on."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

import numpy as np
import pytest
from click.testing import CliRunner

import divespot
from divespot import DivespotError
from divespot import io as dio
from divespot.cli import main
from divespot.extras import is_installed
from divespot.results.document import Document, Survey
from io_samples import UTM, las
from solids import SOLIDS, sampled

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

CONE = sampled(SOLIDS["cone"], 2.0**-6, (1.25, 1.125))
UTM32 = {1024: 1, 3072: 32632, 3076: 9001}


def tiles(folder: Path, **options: dict[int, int]) -> list[Path]:
    """Write four quarters of a cone in UTM."""
    east, north = CONE[:, 0] > 0.1, CONE[:, 1] > 0.05
    quarters = [east & north, east & ~north, ~east & north, ~east & ~north]
    paths = [folder / f"tile-{i}.las" for i in range(4)]
    for path, quarter in zip(paths, quarters, strict=True):
        path.write_bytes(las(CONE[quarter] + UTM, scale=1e-4, geokeys=options.get("keys", UTM32)))
    return paths


def test_tiles_are_one_survey(tmp_path: Path) -> None:
    paths = tiles(tmp_path)
    report = divespot.measure(paths)
    (pile,) = report.piles
    assert pile.volume_m3 == pytest.approx(SOLIDS["cone"].volume_m3, rel=2e-3)
    assert report.source.files == tuple(map(str, paths))
    assert (report.source.path, report.source.crs) == (str(paths[0]), "EPSG:32632")
    assert report.source.points == len(CONE)
    assert divespot.measure(paths[::-1]).total == report.total


def test_one_path_in_a_list_is_that_file(tmp_path: Path) -> None:
    path = tiles(tmp_path)[0]
    alone, listed = dio.read(path), dio.read([str(path)])
    np.testing.assert_array_equal(alone.points, listed.points)
    assert (listed.path, listed.files) == (alone.path, ())


def test_merge_on_the_command_line(tmp_path: Path) -> None:
    paths = list(map(str, tiles(tmp_path)))
    base = tmp_path / "base.ply"
    options = ["--merge", "--json", "-", "--save-base", str(base)]
    result = CliRunner().invoke(main, ["measure", *paths, *options])
    assert result.exit_code == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["source"]["files"] == paths
    assert len(report["piles"]) == 1
    assert base.is_file()
    shown = CliRunner().invoke(main, ["measure", *paths, "--merge"])
    assert "tile-0.las and 3 more: 23" in shown.stdout.replace(str(tmp_path), "")


def test_no_output_takes_the_place_of_a_tile(tmp_path: Path) -> None:
    paths = list(map(str, tiles(tmp_path)))
    result = CliRunner().invoke(main, ["measure", *paths, "--merge", "--json", paths[2], "--force"])
    assert result.exit_code == 1
    report = divespot.measure(paths)
    with pytest.raises(DivespotError, match=r"tile-3.las"):
        divespot.save_outlines(report, paths[3])


def test_several_scans_without_merge_are_several(tmp_path: Path) -> None:
    paths = list(map(str, tiles(tmp_path)))
    picture = str(tmp_path / "a.png")
    result = CliRunner().invoke(main, ["measure", *paths, "--picture", picture])
    assert result.exit_code == 2
    assert "--merge" in result.stderr


def other(folder: Path, points: NDArray[np.float64], keys: dict[int, int]) -> Path:
    path = folder / "other.las"
    path.write_bytes(las(points, geokeys=keys))
    return path


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            {1024: 1, 3072: 32633, 3076: 9001},
            "EPSG:32632 and in EPSG:32633: one reference system is needed",
        ),
        ({1024: 1, 3072: 32632, 3076: 9002}, "are in m and in ft: one unit is needed"),
        ({}, "are in m and in a unit that is not stated"),
    ],
)
def test_files_that_do_not_agree(tmp_path: Path, keys: dict[int, int], words: str) -> None:
    paths = [tiles(tmp_path)[0], other(tmp_path, CONE + UTM, keys)]
    with pytest.raises(DivespotError, match=words) as caught:
        divespot.measure(paths)
    assert all(path.name in str(caught.value) for path in paths)


def test_a_file_that_states_the_unit_alone_goes_with_the_others(tmp_path: Path) -> None:
    scan = dio.read([tiles(tmp_path)[0], other(tmp_path, CONE + UTM, {3076: 9001})])
    assert scan.crs == "EPSG:32632"
    assert any("other.las states no reference system" in warning for warning in scan.warnings)


def test_one_system_in_other_words_is_the_same(tmp_path: Path) -> None:
    pyproj = pytest.importorskip("pyproj", reason="the extra crs is not installed")
    wkt = pyproj.CRS.from_epsg(32632).to_wkt("WKT1_GDAL")
    path = tmp_path / "other.las"
    path.write_bytes(las(CONE + UTM, wkt=wkt))
    assert len(dio.read([tiles(tmp_path)[0], path]).points) > len(CONE)


def test_a_warning_names_its_files(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("a.xyz", "b.xyz", "c.xyz")]
    for i, path in enumerate(paths):
        path.write_text(("a,b,c\n" if i else "") + "1.5,2.5,3.5\n" * 20)
    warnings = dio.read(paths).warnings
    assert [w.split(": ")[0] for w in warnings if "header" in w] == [f"{paths[1]} and 1 more"]


@pytest.mark.parametrize("source", [[], ["a.ply", 3], [b"a"]])
def test_what_is_no_list_of_paths(source: list[object]) -> None:
    with pytest.raises(DivespotError):
        divespot.measure(source)  # type: ignore[arg-type]


def test_a_file_of_several_that_cannot_be_read(tmp_path: Path) -> None:
    paths = [*tiles(tmp_path)[:2], tmp_path / "none.las"]
    with pytest.raises(DivespotError, match=r"none.las: cannot be read"):
        divespot.measure(paths)
    result = CliRunner().invoke(main, ["measure", *map(str, paths), "--merge"])
    assert (result.exit_code, result.stderr.count("\n")) == (1, 1)


def test_results_are_of_all_files(tmp_path: Path) -> None:
    paths = tiles(tmp_path)
    out = tmp_path / "out.laz"
    report = divespot.measure(paths)
    report.save(out)
    assert len(dio.read(out).points) == len(CONE)
    if is_installed("pyproj"):  # which knows the system by its code
        assert divespot.measure(out).total.volume_m3 == pytest.approx(
            report.total.volume_m3, abs=report.total.u95_m3 / 10
        )
    told = [value for _, value in Document.of(report, Survey(), 1).provenance]
    for path in paths:
        assert hashlib.sha256(path.read_bytes()).hexdigest() == told[told.index(str(path)) + 1]
    again = divespot.Report.from_json(report.to_json())
    assert again == report
