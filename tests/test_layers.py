"""Files import downwards only: no circle, no arrow to a higher layer."""

from __future__ import annotations

import pytest

from imports import Graph, circles, python_imports, rust_imports

#: The package's layers, the lowest first: each imports from itself and from those before it.
LAYERS = {
    "words": "_native base_name directions dot errors extras log materials numbers progress "
    "reasons selection",
    "checks": "_arguments boxes output",
    "files": "cores io",
    "settings": "_options _typed stages settings mass",
    "kernels": "accumulator clustering grid kernels plane spacing",
    "depth frames": "frames",
    "stages": "sensor narrowing too_large blocks one_pass streaming intake lengths thinning "
    "clusters filters up pose gaps frame surface_outliers surface ground_level earlier bases "
    "detection place_maps judgement objects holes differences outline_checks outline_place "
    "outline_features outline_file projection rounding",
    "report": "budget level report describe",
    "results": "plot save volume results doors",
    "method": "overview repeated cleaning standing windows sightings tiled pipeline comparing "
    "scale divespot",
    "scenes": "simulate",
    "errors of known scans": "evaluate",
    "the paper's tables": "reproduce",
    "command line": "cli __main__",
}
HEIGHT = {room: height for height, rooms in enumerate(LAYERS.values()) for room in rooms.split()}

#: The core's, in the same way.
CORE_LAYERS = {
    "numbers": "bounds crate cancel count error fixed harmonic hypotenuse lzf material parallel "
    "places robust simple_polygon",
    "points": "accumulator cloud dealt hashing moments nearest neighbors order plane pose "
    "positions sample sensor surface_outliers survey voxel",
    "clusters": "hdbscan",
    "grid": "components connectivity extent ground_peak heightmap histogram near_plane slopes "
    "terrain tin",
    "ground": "ground",
    "surface": "surface",
    "piles": "piles",
    "depth frames": "frames",
}
CORE_HEIGHT = {
    room: height for height, rooms in enumerate(CORE_LAYERS.values()) for room in rooms.split()
}


def room(module: str) -> str:
    """Return the file or folder of the package that a module is of."""
    return module.split(".")[1] if "." in module else module


@pytest.fixture(scope="module")
def package() -> Graph:
    return python_imports()


@pytest.fixture(scope="module")
def core() -> Graph:
    def short(name: str) -> str:
        return name.removeprefix("crate::")

    return {short(name): {short(used) for used in uses} for name, uses in rust_imports().items()}


def test_every_file_of_the_package_has_a_layer(package: Graph) -> None:
    assert {room(module) for module in package} | {"_native"} == set(HEIGHT)


def test_the_package_has_no_circle(package: Graph) -> None:
    assert circles(package) == []


def test_the_package_imports_downwards(package: Graph) -> None:
    upward = [
        f"{module} -> {used}"
        for module, uses in package.items()
        for used in uses
        if HEIGHT[room(used)] > HEIGHT[room(module)]
    ]
    assert upward == []


def test_every_file_of_the_core_has_a_layer(core: Graph) -> None:
    assert {module.partition("::")[0] for module in core} == set(CORE_HEIGHT)


def test_the_core_has_no_circle(core: Graph) -> None:
    assert circles(core) == []


def test_the_core_imports_downwards(core: Graph) -> None:
    def height(module: str) -> int:
        return CORE_HEIGHT[module.partition("::")[0]]

    upward = [
        f"{module} -> {used}"
        for module, uses in core.items()
        for used in uses
        if height(used) > height(module)
    ]
    assert upward == []


def test_a_circle_is_found_around_corners() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set(), "e": {"a"}}
    assert circles(graph) == [frozenset("abc")]
