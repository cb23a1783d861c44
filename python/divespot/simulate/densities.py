"""Randomly drawn scenes of uneven, repeated or few points."""

from __future__ import annotations

import math
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from divespot.simulate.floor import Floor
from divespot.simulate.scene import Scene
from divespot.simulate.site import site, upright
from divespot.simulate.tripod import Tripod
from divespot.simulate.varied import in_form, log_uniform, overhead, poured

if TYPE_CHECKING:
    from collections.abc import Mapping

    from divespot.simulate.shapes import Maker

FEWEST, MOST = 80, 2000
"""Range of the number of points on a pile in scenes of few points."""


def tripod(rng: np.random.Generator) -> Scene:
    """Scan a heap from two to four set-ups around it, with density falling with distance."""
    return _set_up(int(rng.integers(2, 5)), rng)


def tripod_once(rng: np.random.Generator) -> Scene:
    """Scan a heap from one set-up, with its far side unseen."""
    return _set_up(1, rng)


def twice(rng: np.random.Generator) -> Scene:
    """Repeat points two to four times, all or those on one side, as where strips overlap."""
    scene = overhead(rng)
    everywhere = rng.random() < 0.5
    beyond_m = -math.inf if everywhere else rng.uniform(-0.3, 0.3) * scene.floor.length_m
    return replace(scene, copies=int(rng.integers(2, 5)), copied_beyond_m=beyond_m)


def few(rng: np.random.Generator) -> Scene:
    """Keep few points, about 80 to 2,000 of them on the pile."""
    at = site(rng, 0.1, 10.0)
    scene = at.scene((), rng)
    wide, across = (2 * math.tan(math.radians(fov) / 2) for fov in at.camera.fov_deg)
    height_m = at.camera.height_m
    view_m2 = (at.camera.rail_m + wide * height_m) * across * height_m
    share = math.pi * at.size_m**2 / view_m2
    return replace(scene, most_points=round(log_uniform(rng, FEWEST, MOST) / share))


def _set_up(count: int, rng: np.random.Generator) -> Scene:
    size_m = log_uniform(rng, 1.0, 10.0)
    turns = rng.uniform(0, 2 * math.pi) + 2 * math.pi * np.arange(count) / count
    turns += rng.uniform(-0.3, 0.3, count)
    far_m = 1.5 + rng.uniform(2.0, 3.5, count) * size_m
    sigma_m = rng.uniform(0.001, 0.005)
    scanner = Tripod(
        frames=count,
        rail_m=0.0,
        height_m=rng.uniform(1.5, 2.0),
        pixels=(round(1800 / count**0.5), round(430 / count**0.5)),
        range_m=(0.5, 300.0),
        noise_m=sigma_m,
        noise_power=0.0,
        noise_max_m=sigma_m,
        bias_m=0.0,
        frame_bias_m=0.0,
        shift_m=0.5 * sigma_m,
        turn_deg=0.002,
        flying_share=0.1,
        stray_share=0.0005,
        stations_m=tuple(zip(*(far_m * (np.cos(turns), np.sin(turns))).tolist(), strict=True)),
    )
    side_m = 2 * (far_m.max() + 2 * size_m + 3.0)
    return Scene(
        Floor(side_m, side_m, side_m / 550),
        (in_form(poured(size_m, (0.0, 0.0), rng), rng),),
        (),
        scanner,
        upright(size_m, rng),
        fuse_voxel_m=0.0,
    )


DENSITIES: Mapping[str, Maker] = MappingProxyType(
    {
        "scan-tripod": tripod,
        "scan-tripod-once": tripod_once,
        "scan-twice": twice,
        "scan-few": few,
    }
)
"""Functions that make each scene of uneven, repeated or few points."""
