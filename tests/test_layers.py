"""Files import downwards only: no circle, no arrow to a higher layer."""

from __future__ import annotations

import pytest

from imports import Graph, circles, python_imports, rust_imports

#: The package's layers, the lowest first: each imports from itself and from those before it.
LAYERS = {
    "words": "_native base_name directions dot errors extras log materials numbers progress "
    "selection",
    "checks": "_arguments output",
    "files": "io",
    "settings": "_options _typed stages settings mass",
    "kernels": "clustering grid kernels plane spacing",
    "depth frames": "frames",
    "stages": "sensor intake lengths thinning clusters filters up pose gaps frame strays surface "
    "ground_level earlier bases detection place_maps judgement objects holes differences "
    "outline_checks outline_place outline_features outline_file projection rounding",
    "report": "budget level report describe",
    "results": "plot save volume results doors",
    "method": "overview repeated pipeline comparing divespot",
    "scenes": "simulate",
    "errors of known scans": "evaluate",
    "the paper's tables": "reproduce",
    "command line": "cli __main__",
}
HEIGHT = {room: height for height, rooms in enumerate(LAYERS.values()) for room in rooms.split()}

#: Modules of the core that still import each other around some corner. Only ever fewer.
IN_CIRCLES = {
    *("hdbscan::boruvka", "hdbscan::search", "voxel", "voxel::dense", "voxel::sparse", "piles"),
    *("piles::alone", "piles::bank", "piles::base", "piles::budget", "piles::buried"),
    *("piles::clear", "piles::divided", "piles::enclosed", "piles::face", "piles::flat_top"),
    *("piles::floating", "piles::gaps", "piles::hidden", "piles::near_plane", "piles::object"),
    *("piles::patch", "piles::region", "piles::retaining", "piles::ring", "piles::shadow"),
    *("piles::shape", "piles::standing", "piles::surface", "piles::things", "piles::valley"),
    "piles::wall",
}

#: Modules of `piles` that the layer below, `surface`, uses. Only ever shorter.
KNOWN_UPWARD = {
    *("piles", "piles::base", "piles::hidden", "piles::near_plane", "piles::pieces"),
    "piles::territory",
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


def test_the_core_has_no_circle_but_those_known(core: Graph) -> None:
    found = set().union(*circles(core))
    assert found - IN_CIRCLES == set(), "a new circle"
    assert IN_CIRCLES - found == set(), "no longer in a circle: cross it off"


def test_the_core_s_surface_uses_no_more_of_the_piles(core: Graph) -> None:
    upward = {
        used
        for module, uses in core.items()
        if not module.startswith("piles")
        for used in uses
        if used.startswith("piles")
    }
    assert upward == KNOWN_UPWARD


def test_a_circle_is_found_around_corners() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a", "d"}, "d": set(), "e": {"a"}}
    assert circles(graph) == [frozenset("abc")]
