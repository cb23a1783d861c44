"""Settings that a simulated scan is measured with."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from divespot._typed import Changes
    from divespot.simulate import SimulatedScan


def given_with(taken: SimulatedScan) -> Changes:
    """Return the settings for a scan: outline and floor of its vessel, if any."""
    vessel = taken.scene.vessel
    if vessel is None:
        return {}
    corners_m = np.array([(x, y, vessel.floor_m) for x, y in vessel.outline_m])
    corners = (corners_m @ taken.pose[:3, :3].T + taken.pose[:3, 3]) / taken.scene.unit_m
    outline = {"type": "Polygon", "coordinates": [[*corners.tolist(), corners[0].tolist()]]}
    x, y, z = taken.up.tolist()
    floor = float(taken.up @ corners[0])
    return {"outline": outline, "base": f"height={floor!r}", "up": (x, y, z)}
