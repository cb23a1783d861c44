"""Scenes of the paper's shapes, changed for an experiment."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from divespot.simulate import scene_named
from divespot.simulate.shapes import optical_pose

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from divespot.simulate import Scene

#: Depth error of the camera for the experiment with its height: within the 11 mm that the Azure
#: Kinect's maker allows it.
BIAS_M = 0.010
#: Registration error in height of each frame, which splits one floor into several.
PLATEAUS_M = 0.015
#: Lean of the scan's z for the experiment without pose correction: that of a rail hung by eye.
LEAN_DEG = 1.0
#: A step of the floor itself.
STEP_M = 0.03


def _from_lens(scene: Scene) -> Scene:
    camera = replace(scene.camera, bias_m=BIAS_M)
    return replace(scene, camera=camera, pose=optical_pose(camera))


def _leaning(scene: Scene) -> Scene:
    return replace(scene, pose=replace(scene.pose, roll_deg=LEAN_DEG, pitch_deg=0.0))


def _plateaus(scene: Scene) -> Scene:
    return replace(scene, camera=replace(scene.camera, frame_bias_m=PLATEAUS_M))


def _stepped(scene: Scene) -> Scene:
    return replace(scene, floor=replace(scene.floor, step_m=STEP_M))


STAGES: Mapping[str, Callable[[Scene], Scene]] = MappingProxyType(
    {
        "as it is": lambda scene: scene,
        "from the lens": _from_lens,
        "leaning": _leaning,
        "plateaus": _plateaus,
        "stepped": _stepped,
    }
)
"""What is done to a scene, by name."""


def staged(name: str, seed: int, stage: str) -> Scene:
    """Return a named scene, changed."""
    return STAGES[stage](scene_named(name, seed))
