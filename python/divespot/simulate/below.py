"""Randomly drawn scenes with points below the floor."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate.ghosts import Ghosts
from divespot.simulate.site import site
from divespot.simulate.varied import log_uniform

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from divespot.simulate.scene import Scene
    from divespot.simulate.shapes import Maker


def mirror(rng: np.random.Generator) -> Scene:
    """Let a wet floor mirror the pile and the objects around it."""
    scene = site(rng, 0.1, 10.0).scene((), rng)
    return replace(scene, ghosts=Ghosts(mirror_share=log_uniform(rng, 0.002, 0.05)))


def strays(rng: np.random.Generator) -> Scene:
    """Add multipath returns behind the surface, and clumps of points far below the floor."""
    at = site(rng, 0.1, 10.0)
    ghosts = Ghosts(
        late_share=log_uniform(rng, 0.0005, 0.01),
        low_points=int(rng.integers(6, 100)),
        low_clumps=int(rng.integers(1, 6)),
        low_m=rng.uniform(0.3, 4.0) * at.size_m,
    )
    return replace(at.scene((), rng), ghosts=ghosts)


BELOW: Mapping[str, Maker] = MappingProxyType({"below-mirror": mirror, "below-strays": strays})
"""Functions that make each scene with points below the floor."""
