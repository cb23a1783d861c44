//! Neighbours on a surface: cells in plan, half a radius wide, with few points each.

use super::{CHUNK, Radius};
use crate::parallel::{fill_chunks, map_chunks};
use crate::{Bounds, Point};

/// Cells a point that are worth a table of all of them.
const MOST_CELLS: f64 = 8.0;
/// A point's own cell holds this many on average, at most; with more, those above and below each
/// other are too many to be looked at in any order.
pub(super) const DEEPEST: usize = 12;
/// Candidates that are counted before the next look at whether they are enough.
const BLOCK: usize = 16;
/// Empty cells around all others, so that all have neighbours.
const FRAME: usize = 2;
/// Where neighbours may be: rows off a cell, first and last column off it. The nearest come first.
const RUNS: [(isize, isize, isize); 11] = [
    (0, -1, 1),
    (-1, -1, 1),
    (1, -1, 1),
    (0, -2, -2),
    (0, 2, 2),
    (-1, -2, -2),
    (-1, 2, 2),
    (1, -2, -2),
    (1, 2, 2),
    (-2, -2, 2),
    (2, -2, 2),
];

#[derive(Debug, Clone, Copy)]
struct Entry {
    point: Point,
    row: u32,
    cell: u32,
}

/// Points sorted into cells, row by row: neighbouring cells of a row lie together.
pub(super) struct Cells {
    entries: Vec<Entry>,
    /// Where the entries of each cell start, and where the last one's end.
    starts: Vec<u32>,
    /// From a cell to that in the next row.
    width: usize,
}

impl Cells {
    /// The cells of a cloud, if points in them have no more than `deepest` in their own on average,
    /// and they are few enough for a table.
    pub(super) fn up_to(
        deepest: usize,
        points: &[Point],
        bounds: &Bounds,
        radius: Radius,
        threads: usize,
    ) -> Option<Self> {
        let edge = radius.reach / 2.0;
        let [wide, long] = [0, 1].map(|k| (bounds.extent()[k] / edge).floor() + 5.0);
        if wide * long > MOST_CELLS * points.len() as f64 || wide * long > f64::from(i32::MAX) {
            return None;
        }
        let width = wide as usize;
        let along = |p: &Point, k: usize| ((p[k] - bounds.min[k]) / edge) as usize + FRAME;
        let cell = |p: &Point| (along(p, 1) * width + along(p, 0)) as u32;
        let mut cells = vec![0; points.len()];
        fill_chunks(&mut cells, CHUNK, threads, |first, piece| {
            piece.iter_mut().zip(&points[first..]).for_each(|(to, p)| *to = cell(p));
        });
        let (mut starts, most) = counted(&cells, width * long as usize);
        if most > deepest * points.len() {
            return None;
        }
        let rows = sorted(&cells, &mut starts);
        let mut entries = vec![Entry { point: [0.0; 3], row: 0, cell: 0 }; points.len()];
        fill_chunks(&mut entries, CHUNK, threads, |first, piece| {
            for (entry, &row) in piece.iter_mut().zip(&rows[first..]) {
                let (point, cell) = (points[row as usize], cells[row as usize]);
                *entry = Entry { point, row, cell };
            }
        });
        Some(Self { entries, starts, width })
    }

    /// Whether each point has enough neighbours.
    pub(super) fn mask(&self, min_neighbors: usize, radius: Radius, threads: usize) -> Vec<bool> {
        let found = map_chunks(self.entries.len(), CHUNK, threads, |range| {
            let hold = |entry: &Entry| self.hold(min_neighbors + 1, entry, radius);
            self.entries[range].iter().map(hold).collect::<Vec<bool>>()
        });
        let mut mask = vec![false; self.entries.len()];
        for (entry, keep) in self.entries.iter().zip(found.into_iter().flatten()) {
            mask[entry.row as usize] = keep;
        }
        mask
    }

    /// Whether `needed` entries, this one among them, lie within the radius of it.
    fn hold(&self, needed: usize, entry: &Entry, radius: Radius) -> bool {
        let mut found = 0;
        let near = |e: &&Entry| radius.holds(entry.point, e.point);
        RUNS.iter().any(|&(row, first, last)| {
            self.run(entry.cell, row, first, last).chunks(BLOCK).any(|block| {
                found += block.iter().filter(near).count();
                found >= needed
            })
        })
    }

    /// The entries from one cell to another in a row near `cell`.
    fn run(&self, cell: u32, row: isize, first: isize, last: isize) -> &[Entry] {
        let middle = (cell as usize).wrapping_add_signed(row * self.width.cast_signed());
        let start = |off: isize| self.starts[middle.wrapping_add_signed(off)] as usize;
        &self.entries[start(first)..start(last + 1)]
    }
}

/// Two places after each of `count` cells' own the points up to its end; the sum of the squares of
/// the points in each.
fn counted(cells: &[u32], count: usize) -> (Vec<u32>, usize) {
    let mut starts = vec![0_u32; count + 2];
    cells.iter().for_each(|&cell| starts[cell as usize + 2] += 1);
    let (mut sum, mut squares) = (0, 0);
    for start in &mut starts {
        squares += *start as usize * *start as usize;
        sum += *start;
        *start = sum;
    }
    (starts, squares)
}

/// The rows in the order of their cells. `starts`, with the start of each cell one place after its
/// own, is left with it in place.
fn sorted(cells: &[u32], starts: &mut [u32]) -> Vec<u32> {
    let mut rows = vec![0; cells.len()];
    for (row, &cell) in (0..).zip(cells) {
        let start = &mut starts[cell as usize + 1];
        rows[*start as usize] = row;
        *start += 1;
    }
    rows
}
