//! Sums up any number of points in voxels.

use crate::cancel::Polled;
use crate::{Error, Point, Result};

use super::lattice::Lattice;
use super::sums::{BITS, NOTHING, Sums};
use super::tiles::{Tile, Tiles};

/// The highest level, with voxels 2¹⁴ times as wide: sums of 2³² points still fit.
pub(super) const HIGHEST: u32 = 14;

/// Voxels and the integer sums of their points. The same points give the same bits in any order, in
/// any chunks and on any number of machines.
///
/// Voxels start with a width of `voxel_m`. If more than `most` of them are occupied, all widths are
/// doubled, as often as needed. The final level is the finest at which `most` voxels suffice, in
/// whatever order the points came. A voxel takes about 45 bytes.
///
/// ```
/// use divespot_core::accumulator::Accumulator;
///
/// let mut here = Accumulator::new([0.0; 3], 0.5, 1000)?;
/// here.add([[0.1, 0.1, 0.0], [5.0, 0.0, 0.0]])?;
/// let mut there = here.empty();
/// there.add([[0.3, 0.1, 0.0]])?;
/// here.merge(&there)?;
/// assert_eq!((here.points(), here.voxels()), (3, 2));
/// assert_eq!(here, Accumulator::from_bytes(&here.to_bytes())?);
/// # Ok::<(), divespot_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Accumulator {
    pub(super) lattice: Lattice,
    pub(super) level: u32,
    pub(super) most: usize,
    pub(super) tiles: Tiles,
    /// Numbers of dropped points: with a coordinate that is not finite; at (0, 0, 0).
    pub(super) dropped: [u64; 2],
}

/// The occupied voxels, in an order that does not depend on that of the points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Held {
    /// Mean of each voxel's points, in m.
    pub means: Vec<Point>,
    /// Number of points in each voxel.
    pub counts: Vec<u32>,
    /// Lowest and highest height of the points in each voxel, in m.
    pub bounds_m: Vec<[f64; 2]>,
}

impl Accumulator {
    /// Creates an empty accumulator with voxels of width `voxel_m`, one of which has its lowest
    /// corner at `origin`; `most` is the largest number of voxels held.
    ///
    /// # Errors
    ///
    /// [`Error::Setting`] unless the width is finite and above 0, the origin finite and `most` above
    /// 0.
    pub fn new(origin: Point, voxel_m: f64, most: usize) -> Result<Self> {
        if most == 0 {
            return Err(Error::Setting { name: "most", given: 0.0, needed: "a number above 0" });
        }
        let lattice = Lattice::new(origin, voxel_m)?;
        Ok(Self { lattice, level: 0, most, tiles: Tiles::default(), dropped: [0; 2] })
    }

    /// An empty accumulator with the same voxels, which can be merged into this one.
    #[must_use]
    pub fn empty(&self) -> Self {
        let Self { lattice, most, .. } = *self;
        Self { lattice, level: 0, most, tiles: Tiles::default(), dropped: [0; 2] }
    }

    /// Current width of the voxels, in m.
    #[must_use]
    pub fn voxel_m(&self) -> f64 {
        self.lattice.edge_m * f64::from(self.level).exp2()
    }

    /// Number of occupied voxels.
    #[must_use]
    pub fn voxels(&self) -> usize {
        self.tiles.occupied
    }

    /// Number of points in them.
    #[must_use]
    pub fn points(&self) -> u64 {
        let tiles = self.tiles.tiles().iter();
        tiles.flat_map(Tile::voxels).map(|(_, sums)| u64::from(sums.count)).sum()
    }

    /// Numbers of dropped points: not finite; at (0, 0, 0), a depth camera's mark for no depth.
    #[must_use]
    pub fn dropped(&self) -> [u64; 2] {
        self.dropped
    }

    /// Adds points.
    ///
    /// # Errors
    ///
    /// [`Error::GridTooLarge`] for a point farther than 2³⁴ voxels from the origin, or if `most`
    /// voxels of 2¹⁴ times the width do not suffice; [`Error::Degenerate`] if a voxel would hold
    /// 2³² points.
    pub fn add(&mut self, points: impl IntoIterator<Item = Point>) -> Result<()> {
        // Neighbours in a file are mostly in one voxel, which is then looked up only once.
        let (mut run, mut sums) = ([u64::MAX; 3], NOTHING);
        for p in points.into_iter().polled() {
            if !p.iter().all(|v| v.is_finite()) {
                self.dropped[0] += 1;
            } else if p == [0.0; 3] {
                self.dropped[1] += 1;
            } else {
                let whole = self.lattice.whole(&p).ok_or_else(|| self.too_far(&p))?;
                if self.voxel(whole) != run {
                    self.put(run, &sums)?;
                    (run, sums) = (self.voxel(whole), NOTHING);
                }
                let within = (1 << (BITS + self.level)) - 1;
                sums.add(whole.map(|v| v & within), self.level)?;
            }
        }
        self.put(run, &sums)
    }

    /// The voxel of a place.
    #[inline]
    fn voxel(&self, whole: [u64; 3]) -> [u64; 3] {
        whole.map(|v| v >> (BITS + self.level))
    }

    /// Adds to a voxel; may double the widths.
    fn put(&mut self, voxel: [u64; 3], sums: &Sums) -> Result<()> {
        if sums.count == 0 {
            return Ok(());
        }
        self.tiles.sums(voxel).merge(sums)?;
        if self.tiles.occupied > self.most { self.keep_within() } else { Ok(()) }
    }

    /// Adds the points of another accumulator.
    ///
    /// # Errors
    ///
    /// [`Error::Degenerate`] if its voxels are different or one would hold 2³² points,
    /// [`Error::GridTooLarge`] as in [`Accumulator::add`].
    pub fn merge(&mut self, other: &Self) -> Result<()> {
        if (self.lattice, self.most) != (other.lattice, other.most) {
            return Err(Error::Degenerate(
                "accumulators of other voxels were given: the same origin, voxel_m and most \
                 are needed",
            ));
        }
        if other.level > self.level {
            self.raise(other.level)?;
        }
        (0..2).for_each(|k| self.dropped[k] += other.dropped[k]);
        for tile in other.tiles.tiles().iter().polled() {
            self.take(tile, other.level)?;
        }
        Ok(())
    }

    /// Adds the voxels of a tile at `level` or below.
    fn take(&mut self, tile: &Tile, level: u32) -> Result<()> {
        for (number, sums) in tile.voxels() {
            let (voxel, up) = (tile.voxel(number), self.level - level);
            let corner = voxel.map(|v| v & ((1 << up) - 1));
            self.put(voxel.map(|v| v >> up), &sums.raised(corner, level, up))?;
        }
        Ok(())
    }

    /// Doubles the width until the number of voxels is within `most`.
    #[cold]
    fn keep_within(&mut self) -> Result<()> {
        while self.tiles.occupied > self.most {
            self.raise(self.level + 1)?;
        }
        Ok(())
    }

    fn raise(&mut self, level: u32) -> Result<()> {
        if level > HIGHEST {
            let cells = self.tiles.occupied as f64;
            return Err(Error::GridTooLarge { name: "voxel_m", cells });
        }
        let (before, tiles) = (self.level, std::mem::take(&mut self.tiles));
        self.level = level;
        tiles.into_tiles().into_iter().polled().try_for_each(|tile| self.take(&tile, before))
    }

    fn too_far(&self, p: &Point) -> Error {
        let steps = (0..3).map(|k| ((p[k] - self.lattice.origin[k]) / self.lattice.edge_m).abs());
        Error::GridTooLarge { name: "voxel_m", cells: steps.fold(0.0, f64::max) }
    }

    /// The occupied voxels, tile by tile in the order of their places, within each from the lowest
    /// up.
    #[must_use]
    pub fn held(&self) -> Held {
        let mut held = Held::default();
        for tile in self.tiles.sorted().into_iter().polled() {
            for (number, sums) in tile.voxels() {
                held.push(&self.lattice, Mean::of(tile.voxel(number), sums, self.level));
            }
        }
        held
    }
}

impl PartialEq for Accumulator {
    fn eq(&self, other: &Self) -> bool {
        self.to_bytes() == other.to_bytes()
    }
}

/// The mean of one or several voxels, in parts of a width at level 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    pub(super) at: [f64; 3],
    pub(super) count: u32,
    low: f64,
    high: f64,
}

impl Mean {
    pub(super) fn of(voxel: [u64; 3], sums: &Sums, level: u32) -> Self {
        let corner = voxel.map(|v| (v << (BITS + level)) as f64);
        let part = |k: usize| sums.xyz[k] as f64 / f64::from(sums.count);
        let bound = |v: u16| corner[2] + f64::from(u32::from(v) << level);
        Self {
            at: std::array::from_fn(|k| corner[k] + part(k)),
            count: sums.count,
            low: bound(sums.low),
            high: bound(sums.high),
        }
    }

    /// The weighted mean of two.
    pub(super) fn with(&self, other: &Self) -> Self {
        let (mine, theirs) = (f64::from(self.count), f64::from(other.count));
        let share = theirs / (mine + theirs);
        Self {
            at: std::array::from_fn(|k| self.at[k] + share * (other.at[k] - self.at[k])),
            count: self.count.saturating_add(other.count),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }
}

impl Held {
    pub(super) fn push(&mut self, lattice: &Lattice, mean: Mean) {
        let height = |z: f64| lattice.place([0.0, 0.0, z])[2];
        self.means.push(lattice.place(mean.at));
        self.counts.push(mean.count);
        self.bounds_m.push([height(mean.low), height(mean.high)]);
    }
}
