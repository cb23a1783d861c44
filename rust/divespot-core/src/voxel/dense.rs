//! Voxel downsampling in dense boxes: a bitmap of the cells instead of a sort.

use std::iter::repeat;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::Places;
use crate::cancel::Polled;
use crate::parallel::{map_chunks, share, split_by};

use super::lattice::{Grid, VoxelSums, Voxels};
use super::rows::{Layout, Ranks, Rows, Word};

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 13;
/// A box is dense if it has at most this many 64-bit words, and at most one for each point. Decides
/// no answer.
const MOST_WORDS: u64 = 1 << 26;

/// The voxels of a dense box, and each point's voxel if wanted; `None` if the box is not dense.
pub(super) fn voxels(
    points: Places<'_>,
    grid: &Grid,
    threads: usize,
    with_rows: bool,
) -> Option<(Voxels, Rows)> {
    let [x, y, z] = grid.last;
    let layout = Layout { across: x / 64 + 1, rows: y + 1 };
    let words = layout.across.checked_mul(layout.rows)?.checked_mul(z + 1)?;
    if words > MOST_WORDS.min(points.len() as u64) {
        return None;
    }
    let words = mark(points, *grid, layout, words as usize, threads);
    let ranks = Ranks { grid: *grid, layout, words };
    let count = ranks.words.last().map_or(0, Word::end);
    let voxels = averaged(&ranks, &sums(points, &ranks, count, threads), count, threads);
    let are_less = with_rows && points.len() * size_of::<u32>() < size_of_val(&*ranks.words);
    let rows = are_less.then(|| Rows::Kept(ranks.rows(points, threads)));
    Some((voxels, rows.unwrap_or(Rows::Ranked(ranks))))
}

/// All words, with the bits of the points' cells set.
fn mark(points: Places<'_>, grid: Grid, layout: Layout, words: usize, threads: usize) -> Vec<Word> {
    let marks: Vec<AtomicU64> = (0..words).map(|_| AtomicU64::new(0)).collect();
    map_chunks(points.len(), CHUNK, threads, |range| {
        let (grid, layout) = (grid, layout); // copies, which stay in registers
        for p in points.within(range) {
            let bit = layout.bit(grid.cell(&p));
            let (word, own) = (&marks[(bit / 64) as usize], 1 << (bit % 64));
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
    marks.into_iter().map(word).collect()
}

/// Partial sums of each voxel, one part a thread, or fewer where parts would take more memory than
/// one sum a point.
fn sums(points: Places<'_>, ranks: &Ranks, count: usize, threads: usize) -> Vec<Vec<VoxelSums>> {
    let grid = ranks.grid;
    let parts = (points.len() / count.max(1)).clamp(1, threads);
    map_chunks(points.len(), points.len().div_ceil(parts), threads, |range| {
        let mut sums = vec![VoxelSums::default(); count];
        for p in points.within(range).polled() {
            let cell = grid.cell(&p);
            sums[ranks.of(cell)].add(grid.inside(cell, &p));
        }
        sums
    })
}

/// The means of the occupied voxels, from partial sums.
fn averaged(
    Ranks { grid, layout, words }: &Ranks,
    parts: &[Vec<VoxelSums>],
    count: usize,
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
