"""The paper's shapes as scenes, changed for an experiment."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate import scene_named
from divespot.simulate.draw import stream
from divespot.simulate.over import somebody_over
from divespot.simulate.shapes import optical_pose

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np

    from divespot.simulate import Scene

#: Depth error of the camera for the experiment with its height: within the 11 mm that the Azure
#: Kinect's maker specifies.
BIAS_M = 0.010
#: Error in height of each frame, which splits one floor into several levels.
PLATEAUS_M = 0.015
#: Lean of the scan's z for the experiment without pose correction: that of a rail mounted by eye.
LEAN_DEG = 1.0
#: Number of people moving over the heap, and their largest distance from its middle in cone radii.
PEOPLE, AROUND = 2, 1.0
#: Height of a step of the floor itself.
STEP_M = 0.03


def _from_lens(scene: Scene) -> Scene:
    camera = replace(scene.camera, bias_m=BIAS_M)
    return replace(scene, camera=camera, pose=optical_pose(camera))


def _leaning(scene: Scene) -> Scene:
    return replace(scene, pose=replace(scene.pose, roll_deg=LEAN_DEG, pitch_deg=0.0))


def _with_people(scene: Scene, rng: np.random.Generator) -> Scene:
    """Let people move around and over the heap, each for a few frames."""
    people = (somebody_over(scene, AROUND, rng) for _ in range(PEOPLE))
    return replace(scene, things=(*scene.things, *people))


def _plateaus(scene: Scene) -> Scene:
    return replace(scene, camera=replace(scene.camera, frame_bias_m=PLATEAUS_M))


def _stepped(scene: Scene) -> Scene:
    return replace(scene, floor=replace(scene.floor, step_m=STEP_M))


STAGES: Mapping[str, Callable[[Scene, np.random.Generator], Scene]] = MappingProxyType(
    {
        "as it is": lambda scene, _: scene,
        "from the lens": lambda scene, _: _from_lens(scene),
        "leaning, people": lambda scene, rng: _with_people(_leaning(scene), rng),
        "plateaus": lambda scene, _: _plateaus(scene),
        "stepped": lambda scene, _: _stepped(scene),
    }
)
"""Functions that change a scene, by name."""


def staged(name: str, seed: int, stage: str) -> Scene:
    """Return a named scene, changed."""
    return STAGES[stage](scene_named(name, seed), stream(seed, f"{name} {stage}"))
