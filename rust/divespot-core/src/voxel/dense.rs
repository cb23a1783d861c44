//! Voxel downsampling in dense boxes: a bitmap of the cells instead of a sort.
//!
//! The rank of an occupied voxel is the number of bits set before its own.

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::cancel::Polled;
use crate::parallel::{fill_chunks, share};
use crate::{Places, Point};

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

    fn cell(&self, word: usize, bit: u32) -> [u64; 3] {
        let (row, word) = (word as u64 / self.across, word as u64 % self.across);
        [word * 64 + u64::from(bit), row % self.rows, row / self.rows]
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
    let (bits, words) = mark(points, *grid, layout, words as usize, threads);
    let count = words.last().map_or(0, |last| last.rank(63) + (last.bits >> 63) as usize);
    let mut rows = vec![0; if with_rows { points.len() } else { 0 }];
    fill_chunks(&mut rows, CHUNK, threads, |first, piece| {
        for (row, bit) in piece.iter_mut().zip(&bits[first..]) {
            *row = words[(bit / 64) as usize].rank(bit % 64) as u32;
        }
    });
    let mut voxels = Voxels { means: vec![[0.0; 3]; count], counts: vec![0; count] };
    let slabs = slabs_of(&words, &mut voxels, threads);
    share(slabs.into_iter(), threads, |slab| slab.fill(points, &bits, &words, grid, &layout));
    Some((voxels, rows))
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

/// Some consecutive words and their output, for one thread.
struct Slab<'a> {
    words: Range<usize>,
    means: &'a mut [Point],
    counts: &'a mut [u32],
}

/// One slab for each thread, with roughly equal numbers of voxels.
fn slabs_of<'a>(words: &[Word], out: &'a mut Voxels, threads: usize) -> Vec<Slab<'a>> {
    let count = out.counts.len();
    let (mut means, mut counts) = (&mut out.means[..], &mut out.counts[..]);
    let mut first = 0;
    let take = |thread: usize| {
        let end = count * (thread + 1) / threads;
        let after = words.partition_point(|word| (word.before as usize) < end);
        let size =
            words.get(after).map_or(count, |word| word.before as usize) + means.len() - count;
        Slab {
            words: std::mem::replace(&mut first, after)..after,
            means: means.split_off_mut(..size).unwrap_or_default(),
            counts: counts.split_off_mut(..size).unwrap_or_default(),
        }
    };
    (0..threads).map(take).collect()
}

impl Slab<'_> {
    /// VoxelSums the points of these voxels and writes their means.
    fn fill(self, points: Places<'_>, bits: &[u32], words: &[Word], grid: &Grid, layout: &Layout) {
        let Some(first) = words.get(self.words.start) else { return };
        let mut sums = vec![VoxelSums::default(); self.counts.len()];
        for (bit, p) in bits.iter().zip(points.iter()).polled() {
            let word = (bit / 64) as usize;
            if self.words.contains(&word) {
                let rank = words[word].rank(bit % 64) - first.before as usize;
                sums[rank].add(grid.inside(grid.cell(&p), &p));
            }
        }
        let cells = self.words.flat_map(|w| words[w].set().map(move |bit| layout.cell(w, bit)));
        let out = self.means.iter_mut().zip(self.counts).zip(cells.zip(&sums));
        for ((mean, count), (cell, sums)) in out.polled() {
            (*mean, *count) = (sums.mean(grid, cell), sums.count);
        }
    }
}
