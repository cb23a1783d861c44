"""The stages of the method one by one, as kernels on NumPy arrays."""

import numpy as np

import divespot
from divespot import simulate

points = simulate.scan("shape-05", density=0.1).points
points = points[np.isfinite(points).all(axis=1)]
spacing_m = divespot.point_spacing(points)

kept = points[divespot.radius_outlier_mask(points, 4 * spacing_m, min_neighbors=5)]
plane = divespot.fit_plane(kept, 3 * spacing_m, axis=(0, 0, 1), max_tilt_deg=30)
level = kept @ divespot.rotation_to_z(plane.normal).T - [0, 0, plane.offset_m]

ground_m = divespot.ground_height(level[:, 2], bin_m=0.002)
above = level[level[:, 2] > ground_m + 2 * spacing_m]
labels = divespot.hdbscan(above, min_cluster_size=50, min_samples=5)
pile = above[labels == 0]

grid = divespot.height_map(pile, cell_m=2 * spacing_m)
volume = divespot.integrate(grid.heights_m, grid.cell_m, base_m=ground_m)
print(f"{len(points):,} points, {volume.volume_m3:.4f} m3 above the cut, truth 0.028")
