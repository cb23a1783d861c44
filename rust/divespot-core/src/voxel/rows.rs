//! The voxel of each point: kept, or found again where that takes less memory.
//!
//! The rank of an occupied voxel is the number of bits set before its own.

use super::lattice::Grid;
use crate::parallel::fill_chunks;
use crate::{Places, thread_count};

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;

/// The voxel of each point.
pub enum Rows {
    /// As it was found.
    Kept(Vec<u32>),
    /// To be found again.
    Ranked(Ranks),
}

impl Default for Rows {
    fn default() -> Self {
        Self::Kept(Vec::new())
    }
}

impl Rows {
    /// The voxel of each of the points that the voxels were made of.
    #[must_use]
    pub fn of<'a>(self, points: impl Into<Places<'a>>, threads: usize) -> Vec<u32> {
        match self {
            Self::Kept(rows) => rows,
            Self::Ranked(ranks) => ranks.rows(points.into(), thread_count(threads)),
        }
    }
}

/// The occupied voxels of a dense box, in which that of a point is found again.
pub struct Ranks {
    pub(super) grid: Grid,
    pub(super) layout: Layout,
    pub(super) words: Vec<Word>,
}

impl Ranks {
    /// The voxel of a point in this cell.
    #[inline]
    pub(super) fn of(&self, cell: [u64; 3]) -> usize {
        let bit = self.layout.bit(cell);
        self.words[(bit / 64) as usize].rank(bit % 64)
    }

    /// The voxel of each point.
    pub(super) fn rows(&self, points: Places<'_>, threads: usize) -> Vec<u32> {
        let mut rows = vec![0; points.len()];
        fill_chunks(&mut rows, CHUNK, threads, |first, piece| {
            let places = points.within(first..first + piece.len());
            piece.iter_mut().zip(places).for_each(|(row, p)| {
                *row = self.of(self.grid.cell(&p)) as u32;
            });
        });
        rows
    }
}

/// 64 cells of one row (along x), and the number of occupied voxels before them.
pub(super) struct Word {
    pub(super) bits: u64,
    pub(super) before: u32,
}

impl Word {
    /// The rank of the voxel of this bit.
    #[inline]
    fn rank(&self, bit: u32) -> usize {
        (self.before + (self.bits & ((1 << bit) - 1)).count_ones()) as usize
    }

    /// How many voxels come before the next word's.
    pub(super) fn end(&self) -> usize {
        (self.before + self.bits.count_ones()) as usize
    }

    /// The bits that are set, in ascending order.
    pub(super) fn set(&self) -> impl Iterator<Item = u32> {
        let rest = |bits: &u64| Some(bits & bits.wrapping_sub(1));
        std::iter::successors(Some(self.bits), rest).take_while(|&b| b > 0).map(u64::trailing_zeros)
    }
}

/// The layout of a box's cells as bits: by z, then y, then x; each row begins with a new word.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// Words in a row.
    pub(super) across: u64,
    /// Rows in a layer.
    pub(super) rows: u64,
}

impl Layout {
    /// The index of a cell's bit; below 2³² in a dense box.
    #[inline]
    pub(super) fn bit(&self, [x, y, z]: [u64; 3]) -> u32 {
        ((z * self.rows + y) * self.across * 64 + x) as u32
    }

    /// The cell of a word's first bit.
    pub(super) fn first_cell(&self, word: usize) -> [u64; 3] {
        let (row, word) = (word as u64 / self.across, word as u64 % self.across);
        [word * 64, row % self.rows, row / self.rows]
    }
}
