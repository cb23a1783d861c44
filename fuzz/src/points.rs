//! Filters and surveys of points.

use arbitrary::Arbitrary;
use divespot_core::surface_outliers::surface_mask;
use divespot_core::voxel::voxels_and_rows;
use divespot_core::{radius_outlier_mask, sensor, survey};

use crate::{Number, Points};

#[derive(Debug, Arbitrary)]
pub struct Input {
    points: Points,
    length_m: Number,
    count: u8,
    seed: u64,
    threads: bool,
}

impl Input {
    pub fn run(&self) {
        let Some(cloud) = self.points.cloud() else { return };
        let (points, length_m) = (&cloud.points, self.length_m.value());
        let threads = 1 + usize::from(self.threads);
        let count = cloud.rows.as_ref().map_or(points.len(), |rows| rows.len());
        assert_eq!(count, points.len());
        if let Ok(mask) = radius_outlier_mask(points, length_m, self.count.into(), threads) {
            assert_eq!(mask.len(), points.len());
        }
        if let Ok((voxels, rows)) = voxels_and_rows(points, length_m, threads) {
            assert_eq!(voxels.counts.iter().sum::<u32>() as usize, points.len());
            assert!(voxels.means.iter().flatten().all(|v| v.is_finite()));
            assert_eq!(rows.len(), points.len());
        }
        if let Ok(found) = survey::survey(points, self.seed, threads) {
            assert!(found.spacing_m.is_finite() && found.roughness_m.is_finite());
        }
        assert_eq!(surface_mask(points, threads).len(), points.len());
        let _ = sensor::unevenness_of_rays(points, [self.length_m.near(); 3], self.seed, threads);
    }
}
