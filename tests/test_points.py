"""Every kernel: points with NaN or infinity, and clouds as other kinds of arrays."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy

import divespot
from cases import CASES, UTM, WRONG_POINTS, Cloud, scattered
from divespot import DivespotError

Kernel = Callable[..., Any]

# Each takes a scale, so that lengths can follow the cloud.
POINT_KERNELS: dict[str, Kernel] = {
    "radius_outlier_mask": lambda p, scale=1.0, **kw: divespot.radius_outlier_mask(
        p, 0.0625 * scale, 3, **kw
    ),
    "voxel_downsample": lambda p, scale=1.0, **kw: divespot.voxel_downsample(
        p, 0.125 * scale, return_counts=True, **kw
    ),
    "point_spacing": lambda p, scale=1.0, **_: divespot.point_spacing(p),  # noqa: ARG005
}


def same_bits(a: object, b: object) -> bool:
    if isinstance(a, tuple) and isinstance(b, tuple):
        return all(same_bits(x, y) for x, y in zip(a, b, strict=True))
    return np.asarray(a).tobytes() == np.asarray(b).tobytes()


@pytest.fixture(params=POINT_KERNELS)
def kernel(request: pytest.FixtureRequest) -> Kernel:
    return POINT_KERNELS[request.param]


@pytest.mark.parametrize("name", WRONG_POINTS)
def test_what_is_no_cloud_is_refused_in_one_line(kernel: Kernel, name: str) -> None:
    with pytest.raises(DivespotError) as caught:
        kernel(WRONG_POINTS[name])
    assert "points" in str(caught.value)
    assert "needed" in str(caught.value) or "no array" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_any_guise_of_a_cloud_gives_the_same_bits(kernel: Kernel) -> None:
    cloud = np.round(scattered(500) * 1024) / 1024  # exact in float32 too
    expected = kernel(cloud)
    big_endian = cloud.astype(">f8")
    guises = [cloud.astype(np.float32), np.asfortranarray(cloud), big_endian, cloud.tolist()]
    assert all(same_bits(kernel(guise), expected) for guise in guises)
    read_only = cloud.copy()
    read_only.flags.writeable = False
    assert same_bits(kernel(read_only), expected)
    assert same_bits(kernel((cloud * 1024).astype(int), scale=1024), kernel(cloud * 1024, 1024))


def packed(cloud: Cloud, kind: str, before: int, after: int) -> Cloud:
    """Return a view into packed records, as `np.frombuffer` makes of the body of a file."""
    fields = [("before", "u1", before), ("xyz", kind, 3), ("after", "u1", after)]
    records = np.zeros(len(cloud), fields)
    records["xyz"] = cloud
    view: Cloud = records["xyz"]
    return view


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_a_view_into_packed_records_gives_the_same_bits(kernel: Kernel, kind: str) -> None:
    cloud = np.round(scattered(500) * 1024) / 1024
    expected = kernel(cloud)
    for before, after in ((0, 1), (1, 0), (0, 4), (3, 4), (0, 7), (4, 4), (8, 8)):
        view = packed(cloud, kind, before, after)
        assert same_bits(kernel(view), expected)
        assert same_bits(kernel(view[::-1][::-1]), expected)


def test_an_array_at_any_address_gives_the_same_bits(kernel: Kernel) -> None:
    cloud = scattered(500)
    for off in range(1, 8):
        moved = np.frombuffer(bytes(off) + cloud.tobytes(), cloud.dtype, offset=off)
        assert same_bits(kernel(moved.reshape(cloud.shape)), kernel(cloud))


def test_heights_in_packed_records_give_the_same_bits() -> None:
    heights = scattered(500)[:, 2]
    view = packed(scattered(500), "f8", 1, 0)[:, 2]
    expected = divespot.height_histogram(heights, bin_m=0.01)
    assert same_bits(divespot.height_histogram(view, bin_m=0.01).counts, expected.counts)


def test_what_is_masked_is_not_there(kernel: Kernel) -> None:
    cloud = scattered(500)
    holes = np.zeros(cloud.shape, bool)
    holes[::7, 2] = True
    masked = np.ma.MaskedArray(cloud, holes)
    assert same_bits(kernel(masked), kernel(np.where(holes, np.nan, cloud)))
    whole = np.ma.MaskedArray(np.ones((9, 3), bool), False)  # noqa: FBT003
    with pytest.raises(DivespotError, match="masked bool: real numbers are needed"):
        kernel(whole)


def test_points_that_memory_cannot_hold_are_a_memory_error(kernel: Kernel) -> None:
    with pytest.raises((MemoryError, DivespotError)):
        kernel(np.broadcast_to(np.zeros(3), (2**32 - 2, 3)))


def test_threads_do_not_count(kernel: Kernel) -> None:
    cloud = scattered(20_000)
    expected = kernel(cloud, threads=1)
    assert all(same_bits(kernel(cloud, threads=threads), expected) for threads in (0, 2, 5))


def test_a_kernel_leaves_its_input_alone(kernel: Kernel) -> None:
    cloud = scattered(500)
    before = cloud.copy()
    kernel(cloud)
    assert same_bits(cloud, before)


@settings(max_examples=60, deadline=None)
@given(
    points=st_numpy.arrays(
        st.sampled_from([np.float32, np.float64]),
        st.tuples(st.integers(0, 40), st.just(3)),
        elements={"allow_nan": True, "allow_infinity": True},
    ),
    name=st.sampled_from(sorted(POINT_KERNELS)),
    scale=st.sampled_from([1.0, 1e-300, 1e-6, 1e6, 1e300]),
)
def test_any_numbers_give_a_result_or_one_line(points: Cloud, name: str, scale: float) -> None:
    kernel = POINT_KERNELS[name]
    try:
        result = kernel(points, scale)
    except DivespotError:
        return
    assert same_bits(kernel(points, scale, threads=3), result)


@pytest.mark.parametrize("value", ["3", None, [1.0], -1, 1.5, 2**64])
def test_a_count_is_a_whole_number(value: int) -> None:
    with pytest.raises(DivespotError, match=r"min_neighbors is .* whole number"):
        divespot.radius_outlier_mask(CASES["random"], 0.1, value)
    with pytest.raises(DivespotError, match=r"threads is .* whole number"):
        divespot.voxel_downsample(CASES["random"], 0.1, threads=value)


@pytest.mark.parametrize("value", ["3", None, [1.0], 10**400])
def test_a_length_is_a_number(value: float) -> None:
    with pytest.raises(DivespotError, match=r"radius_m is .* number"):
        divespot.radius_outlier_mask(CASES["random"], value, 1)


@pytest.mark.parametrize("value", [0, -0.1, float("nan"), float("inf")])
def test_a_length_is_above_zero(value: float) -> None:
    cloud = CASES["random"]
    with pytest.raises(DivespotError, match=r"radius_m is .*: a finite number above 0 is needed"):
        divespot.radius_outlier_mask(cloud, value, 1)
    with pytest.raises(DivespotError, match=r"voxel_m is .*: a finite number above 0 is needed"):
        divespot.voxel_downsample(cloud, value)


def test_an_exact_offset_moves_nothing_but_positions() -> None:
    near, far = CASES["random"], CASES["UTM"]
    assert same_bits(
        POINT_KERNELS["radius_outlier_mask"](far), POINT_KERNELS["radius_outlier_mask"](near)
    )
    assert divespot.point_spacing(far) == divespot.point_spacing(near)
    moved, kept = (divespot.voxel_downsample(p, 0.1) for p in (far, near))
    np.testing.assert_allclose(moved, kept + UTM, rtol=0, atol=1e-9)


NO_THREADS = """
import resource, numpy as np, divespot
points = np.random.default_rng(0).random((200_000, 3))
alone = divespot.voxel_downsample(points, 0.02, threads=1)
pages = int(open("/proc/self/statm").read().split()[0])
most = pages * resource.getpagesize() + (200 << 20)
resource.setrlimit(resource.RLIMIT_AS, (most, most))
assert (divespot.voxel_downsample(points, 0.02, threads=1024) == alone).all()
print("done")
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="no limit on the address space")
def test_where_no_thread_can_start_the_work_is_done_on_fewer() -> None:
    command = [sys.executable, "-c", NO_THREADS]
    done = subprocess.run(command, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.stdout == "done\n", done.stderr


def test_more_threads_than_any_machine_has_are_refused() -> None:
    for threads in (1025, 4_294_967_295):
        with pytest.raises(DivespotError, match=r"threads is .* from 0 to 1024 is needed"):
            divespot.voxel_downsample(CASES["random"], 0.1, threads=threads)
        with pytest.raises(DivespotError, match=r"threads is .* from 0 to 1024 is needed"):
            divespot.Settings(threads=threads)
