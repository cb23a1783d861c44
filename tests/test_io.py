"""Scans are read as they are: every format, every unit, real scans."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING, Any

import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from divespot import DivespotError
from divespot import io as dio
from divespot.io.crs import crs_from_geokeys, crs_from_wkt
from io_samples import FINITE, IN_METRES, POINTS, VALID, VALID_LAS, las, npy, npz, pcd, ply, text

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

UTM = np.array([[482310.123, 5456790.4567, 312.1], [482311.0, 5456791.1234, 312.2]])


def read_bytes(folder: Path, name: str, data: bytes, unit: str = "auto") -> dio.Scan:
    path = folder / name
    path.write_bytes(data)
    return dio.read(path, unit=unit)


@pytest.mark.parametrize("name", VALID)
def test_every_format_gives_every_point_in_order(tmp_path: Path, name: str) -> None:
    scan = read_bytes(tmp_path, name, VALID[name])
    np.testing.assert_array_equal(scan.points, POINTS)
    assert scan.points.dtype == np.float64
    assert scan.points.flags.c_contiguous
    stated = name.endswith(IN_METRES)
    assert (scan.unit, scan.unit_stated, scan.crs) == ("m", stated, None)
    assert scan.warnings == ()
    assert scan.path == str(tmp_path / name)


@pytest.mark.parametrize("name", VALID_LAS)
def test_las_and_laz_give_every_point_in_order(tmp_path: Path, name: str) -> None:
    scan = read_bytes(tmp_path, name, VALID_LAS[name])
    np.testing.assert_array_equal(scan.points, FINITE)
    assert scan.points.flags.c_contiguous


def test_path_may_be_text_with_blanks_and_any_script(tmp_path: Path) -> None:
    folder = tmp_path / "höhe 山 x"
    folder.mkdir()
    for name, data in (VALID | VALID_LAS).items():
        (folder / f"ä {name}").write_bytes(data)
        assert len(dio.read(str(folder / f"ä {name}")).points) >= len(FINITE)


@pytest.mark.parametrize("suffix", [".ply", ".npy", ".xyz"])
def test_utm_doubles_are_not_rounded(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"scan{suffix}"
    dio.write(path, UTM)
    np.testing.assert_array_equal(dio.read(path).points, UTM)


@pytest.mark.parametrize("compress", [False, True])
def test_las_keeps_full_double_precision(tmp_path: Path, *, compress: bool) -> None:
    data = las(UTM, compress=compress, scale=1e-4)
    scan = read_bytes(tmp_path, "utm.las", data)
    expected = np.floor(UTM.min(axis=0)) + np.round((UTM - np.floor(UTM.min(axis=0))) / 1e-4) * 1e-4
    np.testing.assert_allclose(scan.points, expected, rtol=0, atol=2e-9)


def test_float32_values_are_kept_exactly(tmp_path: Path) -> None:
    points = np.random.default_rng(1).normal(size=(50, 3)).astype(np.float32)
    for name, data in {
        "a.npy": npy(points),
        "a.ply": ply(points, kinds=("float",) * 3),
        "a.pcd": pcd(points, "binary"),
    }.items():
        np.testing.assert_array_equal(
            read_bytes(tmp_path, name, data).points, points.astype(np.float64)
        )


def test_signalling_nan_warns_nobody(tmp_path: Path) -> None:
    points = np.full((4, 3), 0x7FA00000, np.uint32).view(np.float32)
    assert np.isnan(read_bytes(tmp_path, "a.npy", npy(points)).points).all()


@pytest.mark.parametrize("kind", ["short", "int"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_ply_integers(tmp_path: Path, kind: str, order: str) -> None:
    points = np.array([[1, -2, 3], [300, 400, -500]])
    data = ply(points, order, (kind,) * 3, "yzx")
    np.testing.assert_array_equal(read_bytes(tmp_path, "a.ply", data).points, points)


def test_header_line_ends_of_windows(tmp_path: Path) -> None:
    for name in ("ascii.ply", "ascii.pcd", "cloud.csv", "cloud.pts"):
        data = VALID[name].replace(b"\n", b"\r\n")
        np.testing.assert_array_equal(read_bytes(tmp_path, name, data).points, POINTS)


def test_pcd_headers_that_pcl_accepts(tmp_path: Path) -> None:
    data = b"VERSION .6\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 2\nDATA ascii\n"
    scan = read_bytes(tmp_path, "a.pcd", data + b"1 2 3\nnan nan nan\n")
    np.testing.assert_array_equal(scan.points, [[1, 2, 3], [np.nan] * 3])


ROWS = [[1.5, 2.0, -3.25], [4.0, 5.5, 6e-3]]


@pytest.mark.parametrize(
    "content",
    [
        "1.5 2 -3.25\n4 5.5 6e-3\n",
        "1.5\t2\t-3.25\r\n4\t5.5\t6e-3",
        "1.5, 2, -3.25\n4, 5.5, 6e-3\n\n",
        "1.5;2;-3.25\n4;5.5;6e-3\n",
        "1,5;2,0;-3,25\n4,0;5,5;6e-3\n",
        "1,5\t2\t-3,25\n4\t5,5\t6e-3\n",
        "1,5 2,0 -3,25\n4,0 5,5 0,006\n",
        "  1.5   2  -3.25  \n\n4 5.5   6e-3\n",
        "# a comment\n// another\n1.5 2 -3.25 # here\n# and\n4 5.5 6e-3 // there\n",
        "//X Y Z R\n1.5 2 -3.25 9\n4 5.5 6e-3 9\n",
        "2\n1.5 2 -3.25\n4 5.5 6e-3\n",
        "x y z\n1.5 2 -3.25\n4 5.5 6e-3\n",
        'name,Z,"Y",X\na,-3.25,2,1.5\nb,6e-3,5.5,4\n',
        "id;Easting;Northing;Elevation\n1;1.5;2;-3.25\n2;4;5.5;6e-3\n",
        "1.5 2 -3.25 tree\n4 5.5 6e-3 bush\n",
        "scan of today\nby: me\n1.5 2 -3.25 1 2\n4 5.5 6e-3 1 2\n",
        "\ufeff1.5 2 -3.25\n4 5.5 6e-3\n",
        "# the order is x y z\n1.5 2 -3.25 7\n4 5.5 6e-3 7\n",
    ],
)
def test_text_in_many_hands(tmp_path: Path, content: str) -> None:
    for encoding in ("utf-8", "utf-16"):
        scan = read_bytes(tmp_path, "a.txt", content.encode(encoding))
        np.testing.assert_array_equal(scan.points, ROWS)
        assert scan.warnings == ()


def test_text_header_states_the_unit(tmp_path: Path) -> None:
    for header in ("X [mm];Y [mm];Z [mm]", "x_mm;y_mm;z_mm", "x (mm);y (mm);z (mm)"):
        scan = read_bytes(tmp_path, "a.csv", f"{header}\n1000;2000;3000\n".encode())
        np.testing.assert_allclose(scan.points, [[1, 2, 3]], rtol=1e-15)
        assert (scan.unit, scan.unit_stated) == ("mm", True)


def test_text_with_other_names_takes_the_first_three_and_says_so(tmp_path: Path) -> None:
    scan = read_bytes(tmp_path, "a.csv", b"alpha,beta,gamma\n1,2,3\n")
    np.testing.assert_array_equal(scan.points, [[1, 2, 3]])
    assert "does not name x, y, z" in scan.warnings[0]


@pytest.mark.parametrize(
    "array",
    [
        np.arange(12.0).reshape(4, 3),
        np.arange(12, dtype=np.int16).reshape(4, 3),
        np.asfortranarray(np.arange(12.0).reshape(4, 3)),
        np.arange(12, dtype=">f4").reshape(4, 3),
        np.arange(12.0).reshape(2, 2, 3),
        np.arange(12.0).view([("x", "f8"), ("y", "f8"), ("z", "f8")]),
        np.arange(12.0).view([("x", "f8"), ("y", "f8"), ("z", "f8")]).reshape(2, 2),
    ],
)
def test_npy_shapes(tmp_path: Path, array: NDArray[Any]) -> None:
    expected = np.arange(12.0).reshape(4, 3)
    np.testing.assert_array_equal(read_bytes(tmp_path, "a.npy", npy(array)).points, expected)
    np.testing.assert_array_equal(read_bytes(tmp_path, "a.npz", npz(any=array)).points, expected)


def test_npz_names(tmp_path: Path) -> None:
    for arrays in (
        {"xyz": POINTS, "rgb": POINTS + 1},
        {"points": POINTS, "pickled": np.array([{"a": 1}])},
        {"x": POINTS[:, 0], "y": POINTS[:, 1], "z": POINTS[:, 2], "time": POINTS[:, 0]},
    ):
        scan = read_bytes(tmp_path, "a.npz", npz(**arrays))
        np.testing.assert_array_equal(scan.points, POINTS)


def test_content_goes_before_extension_with_a_warning(tmp_path: Path) -> None:
    scan = read_bytes(tmp_path, "a.laz", VALID["little.ply"])
    np.testing.assert_array_equal(scan.points, POINTS)
    assert scan.warnings == ("the file is called .laz but is PLY, and was read as that",)
    assert read_bytes(tmp_path, "nameless", VALID["little.ply"]).warnings == ()


# Units


@pytest.mark.parametrize("unit", dio.UNITS)
def test_a_given_unit_scales_to_metres_and_back(tmp_path: Path, unit: str) -> None:
    scan = read_bytes(tmp_path, "a.npy", VALID["cloud.npy"], unit)
    np.testing.assert_allclose(scan.points / dio.UNITS[unit], POINTS, rtol=1e-15)
    assert (scan.unit, scan.unit_stated) == (unit, True)


def test_lengths_of_units_are_those_of_the_standard() -> None:
    assert dio.UNITS["ft"] == 0.3048
    assert dio.UNITS["us-ft"] * 3937 == pytest.approx(1200, rel=1e-15)
    assert dio.UNITS["in"] * 12 == pytest.approx(dio.UNITS["ft"], rel=1e-15)


@pytest.mark.parametrize(
    ("keys", "unit"),
    [({3076: 9001}, "m"), ({3076: 9002}, "ft"), ({3076: 9003, 1024: 1}, "us-ft")],
)
def test_las_unit_from_geokeys(tmp_path: Path, keys: dict[int, int], unit: str) -> None:
    scan = read_bytes(tmp_path, "a.las", las(FINITE, geokeys=keys))
    np.testing.assert_allclose(scan.points, FINITE * dio.UNITS[unit], rtol=1e-15)
    assert (scan.unit, scan.unit_stated) == (unit, True)


def test_las_height_in_its_own_unit(tmp_path: Path) -> None:
    scan = read_bytes(tmp_path, "a.las", las(FINITE, geokeys={3076: 9001, 4099: 9003}))
    np.testing.assert_allclose(scan.points, FINITE * [1, 1, 1200 / 3937], rtol=1e-15)
    assert scan.unit == "m"
    assert scan.warnings == ("x and y are in m, z in us-ft",)


def test_a_given_unit_goes_before_the_stated_one_with_a_warning(tmp_path: Path) -> None:
    scan = read_bytes(tmp_path, "a.las", las(FINITE, geokeys={3076: 9002}), "cm")
    np.testing.assert_allclose(scan.points, FINITE * 0.01, rtol=1e-15)
    assert "states the unit ft" in scan.warnings[0]


def test_degrees_are_refused_unless_a_unit_is_given(tmp_path: Path) -> None:
    data = las(FINITE, geokeys={1024: 2, 2048: 4326})
    with pytest.raises(DivespotError, match="degrees"):
        read_bytes(tmp_path, "a.las", data)
    scan = read_bytes(tmp_path, "a.las", data, "m")
    np.testing.assert_array_equal(scan.points, FINITE)
    assert scan.crs == "EPSG:4326"


GEOGCS = 'GEOGCS["WGS 84",DATUM["d",SPHEROID["s",6378137,298.2]],UNIT["degree",0.0174532925]]'
PROJCS = f'PROJCS["p",{GEOGCS},PROJECTION["tm"],PARAMETER["k",1],UNIT["foot",0.3048]]'
VERT = 'VERT_CS["v",VERT_DATUM["d",2005],UNIT["US survey foot",0.3048006096012192],AXIS["Up",UP]]'
PROJCRS2 = (
    'PROJCRS["p",BASEGEOGCRS["b",DATUM["d",ELLIPSOID["e",6378137,298,LENGTHUNIT["metre",1]]]],'
    'CONVERSION["c",METHOD["tm"],PARAMETER["fe",5,LENGTHUNIT["metre",1]]],CS[Cartesian,2],'
    'AXIS["(E)",east,ORDER[1],LENGTHUNIT["foot",0.3048]],'
    'AXIS["(N)",north,ORDER[2],LENGTHUNIT["foot",0.3048]],ID["EPSG",2222]]'
)


@pytest.mark.parametrize(
    ("wkt", "unit", "vertical"),
    [
        (PROJCS, "ft", None),
        (f'COMPD_CS["c",{PROJCS},{VERT}]', "ft", "us-ft"),
        (PROJCRS2, "ft", None),
        (f"BOUNDCRS[SOURCECRS[{PROJCRS2}],TARGETCRS[{GEOGCS}]]", "ft", None),
        (GEOGCS, "degrees", None),
        (f'COMPD_CS["c",{GEOGCS},{VERT}]', "degrees", "us-ft"),
        ('GEOCCS["g",DATUM["d"],UNIT["metre",1]]', "m", None),
        ('LOCAL_CS["mine",UNIT["millimetre",0.001]]', "mm", None),
        ('GEODCRS["g",CS[Cartesian,3],AXIS["X",x],LENGTHUNIT["metre",1]]', "m", None),
        ('PROJCS["a ""quoted"" name [m]",UNIT["m",1.0]]', "m", None),
        ('PROJCS["p",UNIT["Clarke foot",0.3047972654]]', "units of 0.3047972654 m", None),
        ("]]] nothing [[[", None, None),
        ('PROJCS["p",UNIT["metre"', "m", None),
    ],
)
def test_units_in_wkt(wkt: str, unit: str | None, vertical: str | None) -> None:
    crs = crs_from_wkt(wkt)
    assert (crs.unit, crs.vertical_unit, crs.text) == (unit, vertical, wkt)


def test_unit_size_in_geokeys() -> None:
    crs = crs_from_geokeys({3072: 32767, 1026: "mine", 3076: 32767, 3077: 0.3048})
    assert (crs.text, crs.unit) == ("mine", "ft")


def test_las_wkt_and_a_unit_we_do_not_know(tmp_path: Path) -> None:
    assert read_bytes(tmp_path, "a.las", las(FINITE, wkt=PROJCS)).unit == "ft"
    clarke = PROJCS.replace("0.3048]", "0.3047972654]")
    with pytest.raises(DivespotError, match="one of m, dm"):
        read_bytes(tmp_path, "b.las", las(FINITE, wkt=clarke))


# Writing


@given(
    points=hnp.arrays(
        st.sampled_from([np.float32, np.float64]),
        hnp.array_shapes(min_dims=2, max_dims=2, min_side=3, max_side=3).map(lambda s: (s[0], 3)),
        elements={"allow_nan": True, "allow_infinity": True},
    ),
    suffix=st.sampled_from([".ply", ".npy", ".xyz"]),
)
def test_what_is_written_is_read_back(
    points: NDArray[Any],
    suffix: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    path = tmp_path_factory.mktemp("w") / f"scan{suffix}"
    dio.write(path, points)
    np.testing.assert_array_equal(dio.read(path).points, points.astype(np.float64))


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_las_is_written_to_a_tenth_of_a_millimetre_in_metres(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"scan{suffix}"
    dio.write(path, UTM)
    scan = dio.read(path)
    np.testing.assert_allclose(scan.points, UTM, rtol=0, atol=0.6e-4)
    assert (scan.unit, scan.unit_stated) == ("m", True)


@given(
    points=hnp.arrays(np.float64, (4, 3), elements={"allow_nan": False, "allow_infinity": False}),
    separator=st.sampled_from([" ", ",", ";", "\t"]),
)
def test_text_round_trip(
    points: NDArray[Any],
    separator: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    scan = read_bytes(tmp_path_factory.mktemp("t"), "a.csv", text(points, separator))
    np.testing.assert_array_equal(scan.points, points)


def test_importing_the_package_loads_no_format_library() -> None:
    code = (
        "import sys, divespot.io; sys.exit(any(name in sys.modules for name in ('laspy', 'lazrs')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0  # noqa: S603


# Real scans: counts and bounds, from an independent look at each file


@pytest.mark.parametrize(
    ("name", "count", "zeros", "nans", "low", "high", "unit", "stated"),
    [
        (
            "kinectv2_box_1.ply",
            217088,
            15081,
            0,
            (-1.065, -0.977, 0),
            (1.229, 0.474, 1.8),
            "m",
            False,
        ),
        (
            "livox_balls_100.ply",
            39582,
            0,
            0,
            (-0.207, -0.105, -2.084),
            (0.195, 0.14, -1.894),
            "m",
            False,
        ),
        (
            "livox_balls_25.ply",
            27622,
            0,
            0,
            (-0.156, -0.065, -2.092),
            (0.244, 0.17, -2.015),
            "m",
            False,
        ),
        (
            "livox_balls_50.ply",
            51306,
            0,
            0,
            (-0.127, -0.095, -2.094),
            (0.276, 0.148, -1.954),
            "m",
            False,
        ),
        (
            "livox_balls_75.ply",
            42380,
            0,
            0,
            (-0.158, -0.105, -2.094),
            (0.241, 0.137, -1.914),
            "m",
            False,
        ),
        (
            "livox_full_bin_with_zero_points.ply",
            360270,
            243517,
            0,
            (-0.243, -0.178, -2.101),
            (0.237, 0.201, 0),
            "m",
            False,
        ),
        ("unitree_package1.pcd", 7556, 0, 0, (-0.5, -2, 0.151), (1.998, 0.518, 1.5), "m", False),
        (
            "unitree_package2.pcd",
            4133,
            0,
            0,
            (0.473, -0.194, 0.916),
            (0.84, 0.366, 1.5),
            "m",
            False,
        ),
        (
            "mosd_test0.pcd",
            307200,
            0,
            118002,
            (-0.434, -0.306, 0.536),
            (0.554, 0.278, 1.21),
            "m",
            False,
        ),
        (
            "uav_pile_id10_crop.npy",
            4677,
            0,
            0,
            (98.247, 65.971, 592.716),
            (113.254, 84.163, 600.078),
            "m",
            False,
        ),
        (
            "lone-star.laz",
            518862,
            0,
            0,
            (515368.6, 4918340.36, 2322.895),
            (515401.045, 4918381.12, 2338.5775),
            "m",
            False,
        ),
        (
            "lone-star.copc.laz",
            518862,
            0,
            0,
            (515368.602, 4918340.36, 2322.896),
            (515401.043, 4918381.12, 2338.5775),
            "m",
            True,
        ),
        (
            "autzen_trim.laz",
            110000,
            0,
            0,
            (636001.76, 848935.2, 406.26),
            (637179.22, 849497.9, 520.51),
            "ft",
            True,
        ),
        (
            "mvk-thin.las",
            6280,
            0,
            0,
            (2045001.76, 1267501.19, 95.79),
            (2049993.92, 1272499.79, 228.73),
            "us-ft",
            True,
        ),
    ],
)
def test_real_scans(  # noqa: PLR0917  (a table)
    real_scan: Callable[[str], Path],
    name: str,
    count: int,
    zeros: int,
    nans: int,
    low: tuple[float, ...],
    high: tuple[float, ...],
    unit: str,
    stated: bool,  # noqa: FBT001
) -> None:
    scan = dio.read(real_scan(name))
    assert scan.points.shape == (count, 3)
    assert int((scan.points == 0).all(axis=1).sum()) == zeros
    assert int(np.isnan(scan.points).any(axis=1).sum()) == nans
    in_unit = scan.points / dio.UNITS[unit]
    np.testing.assert_allclose(np.nanmin(in_unit, axis=0), low, rtol=0, atol=0.006)
    np.testing.assert_allclose(np.nanmax(in_unit, axis=0), high, rtol=0, atol=0.006)
    assert (scan.unit, scan.unit_stated, scan.warnings) == (unit, stated, ())
