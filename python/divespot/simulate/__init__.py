"""Simulated time-of-flight scans of piles whose volume is known exactly.

``scan("shape-07", seed=3)`` gives points and truth; any `Scene` can be scanned, and varied with
`dataclasses.replace`. NumPy only; all random draws are from one seed.
"""

from divespot.simulate.camera import FLYING, GROUND, INVALID, STRAY, THING
from divespot.simulate.floor import Floor
from divespot.simulate.pose import Pose
from divespot.simulate.scan import SimulatedScan, scan
from divespot.simulate.scene import Camera, Pile, Scene
from divespot.simulate.scenes import NAMES, scene_named
from divespot.simulate.sequence import SimulatedFrames, frames
from divespot.simulate.surface import Surface
from divespot.simulate.things import Box, Hanging, Person, Rod, RoundWall, Thing, Wall

__all__ = [
    "FLYING",
    "GROUND",
    "INVALID",
    "NAMES",
    "STRAY",
    "THING",
    "Box",
    "Camera",
    "Floor",
    "Hanging",
    "Person",
    "Pile",
    "Pose",
    "Rod",
    "RoundWall",
    "Scene",
    "SimulatedFrames",
    "SimulatedScan",
    "Surface",
    "Thing",
    "Wall",
    "frames",
    "scan",
    "scene_named",
]
