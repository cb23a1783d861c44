//! The integer sums of one voxel's points.

use crate::{Error, Result};

/// Resolution of a coordinate: a voxel's width at level 0 has this many bits.
pub(super) const BITS: u32 = 16;

const FULL: Error =
    Error::Degenerate("a voxel would hold 2³² points or more: a smaller voxel_m is needed");

/// The sum of the places in the voxel, in parts of a width at level 0; the number of points; and
/// the bounds of their heights in 1/65,536 of the voxel's own width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Sums {
    pub(super) xyz: [u64; 3],
    pub(super) count: u32,
    pub(super) low: u16,
    pub(super) high: u16,
}

/// The sums of no points.
pub(super) const NOTHING: Sums = Sums { xyz: [0; 3], count: 0, low: u16::MAX, high: 0 };

impl Sums {
    /// Adds a place in a voxel of `level`.
    #[inline]
    pub(super) fn add(&mut self, inside: [u64; 3], level: u32) -> Result<()> {
        let height = (inside[2] >> level) as u16;
        (0..3).for_each(|k| self.xyz[k] += inside[k]);
        (self.low, self.high) = (self.low.min(height), self.high.max(height));
        self.count = self.count.checked_add(1).ok_or(FULL)?;
        Ok(())
    }

    pub(super) fn merge(&mut self, other: &Self) -> Result<()> {
        (0..3).for_each(|k| self.xyz[k] += other.xyz[k]);
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
        self.count = self.count.checked_add(other.count).ok_or(FULL)?;
        Ok(())
    }

    /// The sums for a voxel `up` levels higher, of which this one at `level` is the part at
    /// `corner`.
    pub(super) fn raised(self, corner: [u64; 3], level: u32, up: u32) -> Self {
        let count = u64::from(self.count);
        let bound = |v: u16| (((corner[2] << BITS) + u64::from(v)) >> up) as u16;
        Self {
            xyz: std::array::from_fn(|k| self.xyz[k] + count * (corner[k] << (BITS + level))),
            count: self.count,
            low: bound(self.low),
            high: bound(self.high),
        }
    }

    /// Whether this many points of a voxel at `level` can have these sums.
    pub(super) fn is_possible(&self, level: u32) -> bool {
        let most = u64::from(self.count) * ((1_u64 << (BITS + level)) - 1);
        self.count > 0 && self.low <= self.high && self.xyz.iter().all(|&sum| sum <= most)
    }
}
