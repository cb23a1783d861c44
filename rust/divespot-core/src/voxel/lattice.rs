//! The lattice of voxels over a cloud, and the sums of one voxel.

use crate::fixed::Fixed;
use crate::{Bounds, Error, Point, Result};

/// Grids and histograms begin this share of a cell below the lowest value: 2 less the golden ratio.
///
/// Measured values often lie on a raster whose step divides the cell. If the cells began at the
/// lowest value, all of them would lie on faces between cells, and rounding would decide their
/// cell. This number is the farthest from all fractions with small denominators.
pub(crate) const ANCHOR: f64 = 0.381_966_011_250_105_1;

/// Most cells along an axis: 2⁵², as many as an `f64` can tell apart.
const MOST_CELLS: f64 = 4_503_599_627_370_496.0;

/// The occupied voxels, sorted by z, then y, then x.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Voxels {
    /// Mean of the points in each voxel, in m.
    pub means: Vec<Point>,
    /// Number of points in each voxel.
    pub counts: Vec<u32>,
}

/// The voxels over a box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) origin: Point,
    pub(super) voxel_m: f64,
    pub(super) fixed: Fixed,
    /// The highest cell along each axis.
    pub(super) last: [u64; 3],
}

impl Grid {
    pub(super) fn new(bounds: &Bounds, voxel_m: f64) -> Result<Self> {
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
    pub(super) fn cell(&self, p: &Point) -> [u64; 3] {
        self.steps(p).map(|v| v as i64 as u64) // faster than a cast straight to u64
    }

    /// Distance from the grid's start to `p`, in voxels.
    #[inline]
    pub(super) fn steps(&self, p: &Point) -> Point {
        std::array::from_fn(|k| (p[k] - self.origin[k]) / self.voxel_m + ANCHOR)
    }

    /// The lowest corner of a cell, relative to the origin, in m.
    #[inline]
    pub(super) fn corner(&self, cell: [u64; 3]) -> Point {
        cell.map(|c| c as i64 as f64 * self.voxel_m)
    }

    /// The place of `p` in its cell, in integers; a cell is at most 2³⁰ wide.
    #[inline]
    pub(super) fn inside(&self, cell: [u64; 3], p: &Point) -> [i32; 3] {
        let corner = self.corner(cell);
        std::array::from_fn(|k| self.fixed.encode(p[k] - self.origin[k] - corner[k]) as i32)
    }
}

/// The sums of one voxel's points.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct VoxelSums {
    /// VoxelSums of the distances from the voxel's corner along each axis.
    pub(super) xyz: [i64; 3],
    pub(super) count: u32,
}

impl VoxelSums {
    #[inline]
    pub(super) fn add(&mut self, inside: [i32; 3]) {
        (0..3).for_each(|k| self.xyz[k] += i64::from(inside[k]));
        self.count += 1;
    }

    /// The sums of both.
    pub(super) fn and(mut self, other: &Self) -> Self {
        (0..3).for_each(|k| self.xyz[k] += other.xyz[k]);
        self.count += other.count;
        self
    }

    pub(super) fn mean(&self, grid: &Grid, cell: [u64; 3]) -> Point {
        let corner = grid.corner(cell);
        let inside = self.xyz.map(|sum| grid.fixed.mean(sum as f64, self.count));
        std::array::from_fn(|k| grid.origin[k] + corner[k] + inside[k])
    }
}
