//! The lattice of voxels, and coordinates as integers in it.

use crate::error::positive;
use crate::{Error, Point, Result};

use super::sums::BITS;

/// Added to integer coordinates to make them positive: 2⁵⁰, a multiple of every voxel's width.
const MIDDLE: f64 = (1_u64 << 50) as f64;

/// Cubes of one width, one of which begins at the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lattice {
    pub(super) origin: Point,
    pub(super) edge_m: f64,
    per_m: f64,
}

impl Lattice {
    pub(super) fn new(origin: Point, edge_m: f64) -> Result<Self> {
        positive("voxel_m", edge_m)?;
        if let Some(&given) = origin.iter().find(|v| !v.is_finite()) {
            return Err(Error::Setting { name: "origin", given, needed: "a finite number" });
        }
        Ok(Self { origin, edge_m, per_m: (f64::from(BITS)).exp2() / edge_m })
    }

    /// A place in integer parts of a width; `None` if farther than 2³⁴ widths from the origin.
    #[inline]
    pub(super) fn whole(&self, p: &Point) -> Option<[u64; 3]> {
        let parts: Point = std::array::from_fn(|k| (p[k] - self.origin[k]) * self.per_m);
        let within = parts.iter().all(|v| v.abs() < MIDDLE - 1.0);
        // Faster than a cast straight to u64.
        within.then(|| parts.map(|v| (v + MIDDLE) as i64 as u64))
    }

    /// The place of a mean in m; half a part is added, because coordinates were rounded down.
    pub(super) fn place(&self, parts: [f64; 3]) -> Point {
        std::array::from_fn(|k| self.origin[k] + (parts[k] - MIDDLE + 0.5) / self.per_m)
    }
}
