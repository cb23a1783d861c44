"""What is given to a measurement beside the points."""

from __future__ import annotations

import contextlib
import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from divespot.simulate import SimulatedScan


@contextlib.contextmanager
def given_with(taken: SimulatedScan) -> Iterator[dict[str, Any]]:
    """Yield the settings that a scan is measured with: outline and floor of its vessel, if any."""
    vessel = taken.scene.vessel
    if vessel is None:
        yield {}
        return
    corners_m = np.array([(x, y, vessel.floor_m) for x, y in vessel.outline_m])
    corners = (corners_m @ taken.pose[:3, :3].T + taken.pose[:3, 3]) / taken.scene.unit_m
    outline = {"type": "Polygon", "coordinates": [[*corners.tolist(), corners[0].tolist()]]}
    up = taken.up
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "outline.geojson"
        path.write_text(json.dumps(outline), encoding="utf-8")
        yield {
            "outline": str(path),
            "base": f"height={float(up @ corners[0])!r}",
            "up": ",".join(repr(float(part)) for part in up),
        }
