//! Height maps, of means and of triangles.

use arbitrary::Arbitrary;
use divespot_core::{heightmap, tin};

use crate::{Number, Points};

/// A map of more cells says nothing more, and takes seconds.
const MOST_CELLS: f64 = 1e6;

#[derive(Debug, Arbitrary)]
pub struct Input {
    points: Points,
    cell_m: Number,
}

impl Input {
    pub fn run(&self) {
        let Some(cloud) = self.points.cloud() else { return };
        let cell_m = self.cell_m.value();
        let [x, y, _] = cloud.extent_m;
        if (x / cell_m + 1.0) * (y / cell_m + 1.0) > MOST_CELLS {
            return;
        }
        for make in [heightmap::height_map, tin::height_map] {
            let Ok(map) = make(&cloud.points, cell_m) else { continue };
            assert_eq!(map.heights_m.len(), map.grid.len());
            assert_eq!(map.counts.iter().sum::<u32>() as usize, cloud.points.len());
            assert!(!map.heights_m.iter().any(|h| h.is_infinite()));
        }
    }
}
