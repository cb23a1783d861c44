//! Voxel downsampling in dense boxes: a bitmap of the cells instead of a sort.
//!
//! The rank of an occupied voxel is the number of bits set before its own.

use std::iter::repeat;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::Places;
use crate::cancel::Polled;
use crate::parallel::{fill_chunks, map_chunks, share, split_by};

use super::lattice::{Grid, VoxelSums, Voxels};

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;
/// A box is dense if it has at most this many 64-bit words, and at most one for each point. Decides
/// no answer.
const MOST_WORDS: u64 = 1 << 26;

/// 64 cells of one row (along x), and the number of occupied voxels before them.
struct Word {
    bits: u64,
    before: u32,
}

impl Word {
    /// The rank of the voxel of this bit.
    #[inline]
    fn rank(&self, bit: u32) -> usize {
        (self.before + (self.bits & ((1 << bit) - 1)).count_ones()) as usize
    }

    /// How many voxels come before the next word's.
    fn end(&self) -> usize {
        (self.before + self.bits.count_ones()) as usize
    }

    /// The bits that are set, in ascending order.
    fn set(&self) -> impl Iterator<Item = u32> {
        let rest = |bits: &u64| Some(bits & bits.wrapping_sub(1));
        std::iter::successors(Some(self.bits), rest).take_while(|&b| b > 0).map(u64::trailing_zeros)
    }
}

/// The layout of a box's cells as bits: by z, then y, then x; each row begins with a new word.
#[derive(Debug, Clone, Copy)]
struct Layout {
    /// Words in a row.
    across: u64,
    /// Rows in a layer.
    rows: u64,
}

impl Layout {
    /// The index of a cell's bit; below 2³² in a dense box.
    #[inline]
    fn bit(&self, [x, y, z]: [u64; 3]) -> u32 {
        ((z * self.rows + y) * self.across * 64 + x) as u32
    }

    /// The cell of a word's first bit.
    fn first_cell(&self, word: usize) -> [u64; 3] {
        let (row, word) = (word as u64 / self.across, word as u64 % self.across);
        [word * 64, row % self.rows, row / self.rows]
    }
}

/// The voxels of a dense box, and each point's voxel if wanted; `None` if the box is not dense.
pub(super) fn voxels(
    points: Places<'_>,
    grid: &Grid,
    threads: usize,
    with_rows: bool,
) -> Option<(Voxels, Vec<u32>)> {
    let [x, y, z] = grid.last;
    let layout = Layout { across: x / 64 + 1, rows: y + 1 };
    let words = layout.across.checked_mul(layout.rows)?.checked_mul(z + 1)?;
    if words > MOST_WORDS.min(points.len() as u64) {
        return None;
    }
    let (mut rows, words) = mark(points, *grid, layout, words as usize, threads);
    fill_chunks(&mut rows, CHUNK, threads, |_, bits| {
        bits.iter_mut().for_each(|bit| *bit = words[(*bit / 64) as usize].rank(*bit % 64) as u32);
    });
    let count = words.last().map_or(0, Word::end);
    let parts = sums(points, &rows, count, grid, threads);
    let voxels = averaged(&words, &parts, count, grid, layout, threads);
    Some((voxels, if with_rows { rows } else { Vec::new() }))
}

/// The bit of each point's cell, and all words.
fn mark(
    points: Places<'_>,
    grid: Grid,
    layout: Layout,
    words: usize,
    threads: usize,
) -> (Vec<u32>, Vec<Word>) {
    let marks: Vec<AtomicU64> = (0..words).map(|_| AtomicU64::new(0)).collect();
    let mut bits = vec![0; points.len()];
    fill_chunks(&mut bits, CHUNK, threads, |first, piece| {
        let (grid, layout) = (grid, layout); // copies, which stay in registers
        let places = points.within(first..first + piece.len());
        for (bit, p) in piece.iter_mut().zip(places) {
            *bit = layout.bit(grid.cell(&p));
            let (word, own) = (&marks[(*bit / 64) as usize], 1 << (*bit % 64));
            // Reading is much cheaper than writing, and most voxels are already set.
            if word.load(Ordering::Relaxed) & own == 0 {
                word.fetch_or(own, Ordering::Relaxed);
            }
        }
    });
    let mut count = 0;
    let word = |mark: AtomicU64| {
        let bits = mark.into_inner();
        let before = count;
        count += bits.count_ones();
        Word { bits, before }
    };
    (bits, marks.into_iter().map(word).collect())
}

/// Partial sums of each voxel, one part a thread, or fewer where parts would take more memory than
/// one sum a point.
fn sums(
    points: Places<'_>,
    rows: &[u32],
    count: usize,
    grid: &Grid,
    threads: usize,
) -> Vec<Vec<VoxelSums>> {
    let parts = (points.len() / count.max(1)).clamp(1, threads);
    map_chunks(points.len(), points.len().div_ceil(parts), threads, |range| {
        let mut sums = vec![VoxelSums::default(); count];
        for (&row, p) in rows[range.clone()].iter().zip(points.within(range)).polled() {
            sums[row as usize].add(grid.inside(grid.cell(&p), &p));
        }
        sums
    })
}

/// The means of the occupied voxels, from partial sums.
fn averaged(
    words: &[Word],
    parts: &[Vec<VoxelSums>],
    count: usize,
    grid: &Grid,
    layout: Layout,
    threads: usize,
) -> Voxels {
    let mut voxels = Voxels { means: vec![[0.0; 3]; count], counts: vec![0; count] };
    let pieces = words.chunks(CHUNK);
    let held = |piece: &[Word]| piece[piece.len() - 1].end() - piece[0].before as usize;
    let means = split_by(&mut voxels.means, pieces.clone().map(held));
    let counts = split_by(&mut voxels.counts, pieces.clone().map(held));
    let out = pieces.zip(means).zip(counts).enumerate();
    share(out, threads, |(i, ((piece, means), counts))| {
        let words = piece.iter().zip(i * CHUNK..);
        let cells = words.flat_map(|(word, at)| word.set().zip(repeat(layout.first_cell(at))));
        let ranked = (piece[0].before as usize..).zip(cells);
        for ((mean, count), (rank, (bit, [x, y, z]))) in means.iter_mut().zip(counts).zip(ranked) {
            let sums = parts.iter().fold(VoxelSums::default(), |all, part| all.and(&part[rank]));
            (*mean, *count) = (sums.mean(grid, [x + u64::from(bit), y, z]), sums.count);
        }
    });
    voxels
}
