//! Voxel downsampling: one point, the mean, a voxel.

mod dense;
mod sparse;

use crate::error::positive;
use crate::fixed::Fixed;
use crate::{Bounds, Error, Places, Point, Result, thread_count};

/// Grids and histograms begin this share of a cell below the lowest value: 2 - the golden ratio.
///
/// Measured values often come on a grid of their own whose step divides the cell. Beginning at
/// the lowest one, all of them would lie on faces of cells, and rounding would deal them out.
/// No number stays as far from all fractions with small denominators as this one.
pub(crate) const ANCHOR: f64 = 0.381_966_011_250_105_1;

/// More cells along an axis than these are not told apart by an `f64`.
const MOST_CELLS: f64 = 4_503_599_627_370_496.0;

/// The occupied voxels, sorted by z, then y, then x.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Voxels {
    /// The mean of the points in each voxel.
    pub means: Vec<Point>,
    /// How many points each voxel holds.
    pub counts: Vec<u32>,
}

/// The mean of the points in each occupied cube of edge `voxel_m` (paper, Pre-process 3).
///
/// The cubes start 0.38 of an edge below the points' lowest corner, so that the points of a
/// regular grid whose step divides the edge do not lie on faces of cubes. Coordinates are added
/// as integers, so the means do not depend on the order of the points; they are exact to
/// `voxel_m` / 10⁹. `threads` = 0 takes every core that the process may use.
///
/// # Errors
/// [`Error::Setting`] unless `voxel_m` is finite and above zero, [`Error::GridTooLarge`] where
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

/// The same, and the voxel that each point lies in.
///
/// # Errors
/// As [`voxel_downsample`].
pub fn voxels_and_rows<'a>(
    points: impl Into<Places<'a>>,
    voxel_m: f64,
    threads: usize,
) -> Result<(Voxels, Vec<u32>)> {
    thinned(points.into(), voxel_m, threads, true)
}

/// Voxels, and the rows of all points among them where these are wanted.
fn thinned(
    points: Places<'_>,
    voxel_m: f64,
    threads: usize,
    with_rows: bool,
) -> Result<(Voxels, Vec<u32>)> {
    positive("voxel_m", voxel_m)?;
    let threads = thread_count(threads);
    let Some(bounds) = Bounds::of_all(points, threads) else { return Ok(Default::default()) };
    let grid = Grid::new(&bounds, voxel_m)?;
    Ok(dense::voxels(points, &grid, threads, with_rows)
        .unwrap_or_else(|| sparse::voxels(points, &grid, threads, with_rows)))
}

/// The cubes over a box.
#[derive(Debug, Clone, Copy)]
struct Grid {
    origin: Point,
    voxel_m: f64,
    fixed: Fixed,
    /// The highest cell along each axis.
    last: [u64; 3],
}

impl Grid {
    fn new(bounds: &Bounds, voxel_m: f64) -> Result<Self> {
        let fixed = Fixed::new(voxel_m, u32::MAX as usize);
        let grid = Self { origin: bounds.min, voxel_m, fixed, last: [0; 3] };
        let cells = grid.steps(&bounds.max).into_iter().fold(0.0, f64::max) + 1.0;
        if cells > MOST_CELLS {
            return Err(Error::GridTooLarge { name: "voxel_m", cells });
        }
        Ok(Self { last: grid.cell(&bounds.max), ..grid })
    }

    /// The cell of `p` along each axis.
    #[inline]
    fn cell(&self, p: &Point) -> [u64; 3] {
        self.steps(p).map(|v| v as i64 as u64) // faster than a cast straight to u64
    }

    /// How many voxels lie between the grid's start and `p`.
    #[inline]
    fn steps(&self, p: &Point) -> Point {
        std::array::from_fn(|k| (p[k] - self.origin[k]) / self.voxel_m + ANCHOR)
    }

    /// The place of a cell, relative to the origin.
    #[inline]
    fn corner(&self, cell: [u64; 3]) -> Point {
        cell.map(|c| c as i64 as f64 * self.voxel_m)
    }

    /// The place of `p` in its cell; a cell's edge is 2³⁰ at most.
    #[inline]
    fn inside(&self, cell: [u64; 3], p: &Point) -> [i32; 3] {
        let corner = self.corner(cell);
        std::array::from_fn(|k| self.fixed.encode(p[k] - self.origin[k] - corner[k]) as i32)
    }
}

/// The points of one voxel.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// The sums of their distances from the voxel's corner along each axis.
    xyz: [i64; 3],
    count: u32,
}

impl Sums {
    #[inline]
    fn add(&mut self, inside: [i32; 3]) {
        (0..3).for_each(|k| self.xyz[k] += i64::from(inside[k]));
        self.count += 1;
    }

    fn mean(&self, grid: &Grid, cell: [u64; 3]) -> Point {
        let corner = grid.corner(cell);
        let inside = self.xyz.map(|sum| grid.fixed.mean(sum as f64, self.count));
        std::array::from_fn(|k| grid.origin[k] + corner[k] + inside[k])
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::sample::mix;

    fn cloud(count: u64, size: f64) -> Vec<Point> {
        let coordinate = |n: u64| (mix(n) >> 11) as f64 / (1_u64 << 53) as f64 * size;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(3 * i + k as u64))).collect()
    }

    fn slow(points: &[Point], voxel: f64) -> (Vec<Point>, Vec<u32>) {
        let origin = Bounds::of(points.iter().copied()).unwrap().min;
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
        for voxel in [0.2, 1e-12] {
            let points = cloud(5000, 2.0);
            let (voxels, rows) = voxels_and_rows(&points, voxel, 2).unwrap();
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
