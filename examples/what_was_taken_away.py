"""Two scans of one place: gain and loss between them."""

from dataclasses import replace

import numpy as np

import divespot
from divespot import io, simulate

# On Monday there are three piles, on Tuesday the first of them, 0.035 m3, is gone.
monday = simulate.scene_named("three-piles")
tuesday = replace(monday, piles=monday.piles[1:])
points = simulate.scan(monday, density=0.1).points
io.write("monday.ply", points[np.isfinite(points).all(axis=1)])

report = divespot.measure(simulate.scan(tuesday, density=0.1).points, base="surface=monday.ply")
for change in report.piles:
    if abs(change.volume_m3) > 0.005:  # smaller ones are registration errors of the frames
        print(f"{change.volume_m3:+.4f} ± {change.u95_m3:.4f} m3")
