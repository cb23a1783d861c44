//! Voxel downsampling (paper, Pre-process 3): one point for each voxel, the mean of its points,
//! in m.

mod dense;
mod lattice;
mod rows;
mod sparse;

pub(crate) use lattice::ANCHOR;
pub use lattice::Voxels;
pub use rows::Rows;

use crate::error::positive;
use crate::{Places, Point, Result, thread_count};
use lattice::Grid;

/// The mean of the points in each occupied cube of width `voxel_m` (paper, Pre-process 3).
///
/// The cubes start 0.38 of a width below the points' lowest corner, so that points of a regular
/// raster whose step divides the width do not lie on faces of cubes. Coordinates are summed as
/// integers, so the means do not depend on the order of the points; they are exact to `voxel_m` /
/// 10⁹. `threads` = 0 takes every core that the process may use.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) unless `voxel_m` is finite and above zero, [`Error::GridTooLarge`](crate::Error::GridTooLarge) where
/// an axis has more voxels than an `f64` can tell apart.
///
/// # Examples
///
/// ```
/// use divespot_core::voxel_downsample;
///
/// let points = [[0.0; 3], [0.25, 0.0, 0.0], [5.0, 0.0, 0.0]];
/// let voxels = voxel_downsample(&points, 1.0, 0)?;
/// assert_eq!(voxels.means, [[0.125, 0.0, 0.0], [5.0, 0.0, 0.0]]);
/// assert_eq!(voxels.counts, [2, 1]);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn voxel_downsample(points: &[Point], voxel_m: f64, threads: usize) -> Result<Voxels> {
    thinned(points.into(), voxel_m, threads, false).map(|(voxels, _)| voxels)
}

/// The same, and the voxel of each point.
///
/// # Errors
/// As [`voxel_downsample`].
pub fn voxels_and_rows<'a>(
    points: impl Into<Places<'a>>,
    voxel_m: f64,
    threads: usize,
) -> Result<(Voxels, Rows)> {
    thinned(points.into(), voxel_m, threads, true)
}

/// The voxels, and each point's voxel if wanted.
fn thinned(
    points: Places<'_>,
    voxel_m: f64,
    threads: usize,
    with_rows: bool,
) -> Result<(Voxels, Rows)> {
    positive("voxel_m", voxel_m)?;
    let threads = thread_count(threads);
    let Some(bounds) = points.bounds(threads) else { return Ok(Default::default()) };
    let grid = Grid::new(&bounds, voxel_m)?;
    Ok(dense::voxels(points, &grid, threads, with_rows)
        .unwrap_or_else(|| sparse::voxels(points, &grid, threads, with_rows)))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::Error;
    use crate::sample::mix;

    fn cloud(count: u64, size: f64) -> Vec<Point> {
        let coordinate = |n: u64| (mix(n) >> 11) as f64 / (1_u64 << 53) as f64 * size;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(3 * i + k as u64))).collect()
    }

    fn slow(points: &[Point], voxel: f64) -> (Vec<Point>, Vec<u32>) {
        let origin = crate::Bounds::of(points.iter().copied()).unwrap().min;
        let mut voxels: BTreeMap<[u64; 3], Vec<Point>> = BTreeMap::new();
        for p in points {
            let cell = [2, 1, 0].map(|k| ((p[k] - origin[k]) / voxel + ANCHOR) as u64);
            voxels.entry(cell).or_default().push(*p);
        }
        let mean = |v: &Vec<Point>| {
            std::array::from_fn(|k| v.iter().map(|p| p[k]).sum::<f64>() / v.len() as f64)
        };
        voxels.values().map(|v| (mean(v), v.len() as u32)).unzip()
    }

    #[test]
    fn means_and_counts_are_those_of_a_map() {
        for (count, voxel) in [(1, 0.1), (5000, 0.11), (5000, 3.0), (500, 1e-6), (500, 1e-12)] {
            let points = cloud(count, 1.0);
            let (means, counts) = slow(&points, voxel);
            let found = voxel_downsample(&points, voxel, 2).unwrap();
            assert_eq!(found.counts, counts, "{voxel}");
            for (a, b) in found.means.iter().flatten().zip(means.iter().flatten()) {
                assert!((a - b).abs() <= 1e-9 * voxel + 1e-15, "{voxel}: {a} {b}");
            }
        }
        assert_eq!(voxel_downsample(&[], 0.1, 1), Ok(Voxels::default()));
    }

    #[test]
    fn order_and_threads_do_not_count() {
        for voxel in [0.2, 1e-12] {
            let mut points = cloud(20_000, 2.0);
            let expected = voxel_downsample(&points, voxel, 1);
            points.sort_by_key(|p| p[2].to_bits());
            assert_eq!(voxel_downsample(&points, voxel, 3), expected);
        }
    }

    #[test]
    fn each_point_lies_in_its_voxel() {
        for voxel in [0.2, 0.06, 1e-12] {
            let points = cloud(5000, 2.0);
            let (voxels, rows) = voxels_and_rows(&points, voxel, 2).unwrap();
            let rows = rows.of(&points, 2);
            assert_eq!(rows.len(), points.len());
            for (p, &row) in points.iter().zip(&rows) {
                let mean = voxels.means[row as usize];
                assert!((0..3).all(|k| (p[k] - mean[k]).abs() <= voxel), "{p:?} {mean:?}");
            }
        }
    }

    #[test]
    fn a_regular_grid_falls_evenly() {
        for per_voxel in 1..=8_u32 {
            let step = 0.1 / f64::from(per_voxel);
            let points: Vec<Point> =
                (0..per_voxel * 30).map(|i| [0.0, f64::from(i) * step, 0.7]).collect();
            let counts = voxel_downsample(&points, 0.1, 1).unwrap().counts;
            assert!(counts[1..counts.len() - 1].iter().all(|&c| c == per_voxel), "{counts:?}");
        }
    }

    #[test]
    fn what_has_no_grid_is_refused() {
        for voxel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(voxel_downsample(&[], voxel, 1), Err(Error::Setting { .. })));
        }
        let far = [[0.0; 3], [1e9, 0.0, 0.0]];
        assert!(matches!(voxel_downsample(&far, 1e-9, 1), Err(Error::GridTooLarge { .. })));
    }
}
