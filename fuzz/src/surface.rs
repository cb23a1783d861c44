//! The walk over the surface, and the hills on it.

use arbitrary::Arbitrary;
use divespot_core::piles::label_components;
use divespot_core::surface::{hills, surface_points};

use crate::{Number, Points, Relief};

/// Cells of a map, at most.
const MOST_CELLS: f64 = 1e5;

#[derive(Debug, Arbitrary)]
pub struct Input {
    points: Points,
    relief: Relief,
    cell_m: Number,
    noise_m: Number,
    anywhere: bool,
    gap: u8,
    fewest: u8,
}

impl Input {
    pub fn run(&self) {
        let (cell_m, noise_m) = (self.cell_m.value(), self.noise_m.near().abs());
        let clouds = [self.points.cloud().map(|cloud| cloud.points), Some(self.relief.points())];
        for points in clouds.iter().flatten() {
            let Ok(bounds) = divespot_core::heightmap::bounds(points) else { continue };
            let extent = bounds.extent();
            if (extent[0] / cell_m + 1.0) * (extent[1] / cell_m + 1.0) > MOST_CELLS {
                continue;
            }
            if let Ok(on) = surface_points(points, cell_m, noise_m, self.anywhere) {
                assert_eq!(on.len(), points.len());
            }
        }
        let Some((grid, heights_m)) = self.relief.map() else { return };
        let Ok(found) = hills(&grid, &heights_m) else { return };
        assert!(found.terrain.surface_m.len() == grid.len() && found.labels.len() == grid.len());
        let parts = label_components(&grid, &found.labels, self.gap.into(), self.fewest.into());
        assert!(parts.iter().zip(&found.labels).all(|(part, label)| *part < 0 || *label >= 0));
    }
}
