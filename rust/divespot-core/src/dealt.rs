//! Points sorted into vertical columns over squares in plan.
//!
//! Only columns with points exist, so a distant outlier costs nothing.

use std::ops::Range;

use crate::cancel::Polled;
use crate::order::{Keyed, keyed_by, sort_by_key};
use crate::parallel::fill_chunks;
use crate::{Bounds, Places, Point};

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 4096;
/// Most columns along an axis: the product of two such numbers fits in a key.
const MOST_COLUMNS: f64 = 1_073_741_824.0;
/// Up to this many columns for each point, empty ones included, a counting sort is used; beyond, a
/// sort by key. Decides no answer.
const DENSE: u64 = 2;
/// Blocks for each thread, and fewest points of a block, since the columns around it are read too.
/// Decides no answer.
const BLOCKS: usize = 4;
const FEWEST: usize = 4096;

/// The points that share a column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    pub(crate) key: u64,
    start: u32,
    end: u32,
}

impl Column {
    pub(crate) fn range(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// Some rows of columns, with the rows on either side.
pub(crate) struct Block {
    pub(crate) own: Range<usize>,
    pub(crate) around: Range<usize>,
}

/// The rows of points, column by column.
pub(crate) struct Dealt {
    rows: Vec<u32>,
    columns: Vec<Column>,
    /// Difference of the keys of two columns next to each other across rows.
    pub(crate) row_step: u64,
}

impl Dealt {
    /// Sorts points into columns at least `side_m` wide.
    pub(crate) fn new(points: &[Point], side_m: f64, threads: usize) -> Self {
        let keys = Keys::over(points, side_m, threads);
        let (rows, columns) = match keys.most() {
            Some(most) if most / DENSE <= points.len() as u64 => {
                counted(points, &keys, most as usize, threads)
            }
            _ => sorted(points, &keys, threads),
        };
        Self { rows, columns, row_step: keys.row_step }
    }

    /// A few blocks for each thread.
    pub(crate) fn blocks(&self, threads: usize) -> Vec<Block> {
        let most = (self.rows.len() / (BLOCKS * threads)).max(FEWEST);
        let mut blocks = Vec::new();
        let mut own = 0..0;
        for row in self.columns.chunk_by(|a, b| self.row_of(a.key) == self.row_of(b.key)).polled() {
            own.end += row.len();
            let held = self.columns[own.end - 1].end - self.columns[own.start].start;
            if held as usize >= most {
                blocks.push(self.block(own.clone()));
                own.start = own.end;
            }
        }
        if !own.is_empty() {
            blocks.push(self.block(own));
        }
        blocks
    }

    /// The rows of points in some columns, and these columns with their ranges there.
    pub(crate) fn within(&self, range: &Range<usize>) -> (&[u32], Vec<Column>) {
        let columns = &self.columns[range.clone()];
        let (Some(first), Some(last)) = (columns.first(), columns.last()) else {
            return (&[], Vec::new());
        };
        let moved =
            |c: &Column| Column { start: c.start - first.start, end: c.end - first.start, ..*c };
        (&self.rows[first.start as usize..last.end as usize], columns.iter().map(moved).collect())
    }

    fn row_of(&self, key: u64) -> u64 {
        key / self.row_step
    }

    fn block(&self, own: Range<usize>) -> Block {
        let (first, last) = (self.columns[own.start].key, self.columns[own.end - 1].key);
        let (low, high) = (self.row_of(first) - 1, self.row_of(last) + 2);
        let at = |row: u64| self.columns.partition_point(|c| self.row_of(c.key) < row);
        Block { own, around: at(low)..at(high) }
    }
}

/// The key of each point's column; keys along a row are consecutive.
///
/// There is an empty column at both ends of a row and an empty row before the first, so that rows
/// do not touch. Rows run across the longer axis, which makes them numerous.
struct Keys {
    low: Point,
    side_m: f64,
    across: usize,
    along: usize,
    row_step: u64,
    rows: u64,
}

impl Keys {
    fn over(points: &[Point], side_m: f64, threads: usize) -> Self {
        let zero = Bounds { min: [0.0; 3], max: [0.0; 3] };
        let bounds = Places::from(points).bounds(threads).unwrap_or(zero);
        let extent = bounds.extent();
        let side_m = side_m.max(extent[0].max(extent[1]) / MOST_COLUMNS);
        let (along, across) = if extent[0] > extent[1] { (1, 0) } else { (0, 1) };
        let cells = |k: usize| (extent[k] / side_m) as u64 + 3;
        Self { low: bounds.min, side_m, across, along, row_step: cells(along), rows: cells(across) }
    }

    #[inline]
    fn of(&self, p: &Point) -> u64 {
        let cell = |k: usize| ((p[k] - self.low[k]) / self.side_m) as i64 as u64 + 1; // by i64: faster
        cell(self.across) * self.row_step + cell(self.along)
    }

    /// One more than the highest key; `None` if it does not fit in 64 bits.
    fn most(&self) -> Option<u64> {
        self.row_step.checked_mul(self.rows)
    }
}

fn counted(points: &[Point], keys: &Keys, most: usize, threads: usize) -> (Vec<u32>, Vec<Column>) {
    let mut key_of = vec![0_u32; points.len()];
    fill_chunks(&mut key_of, CHUNK, threads, |first, piece| {
        piece.iter_mut().zip(&points[first..]).for_each(|(key, p)| *key = keys.of(p) as u32);
    });
    let mut ends = vec![0_u32; most];
    key_of.iter().polled().for_each(|&key| ends[key as usize] += 1);
    let mut columns = Vec::new();
    let mut start = 0;
    for (key, end) in (0..).zip(&mut ends) {
        let count = std::mem::replace(end, start);
        if count > 0 {
            columns.push(Column { key, start, end: start + count });
        }
        start += count;
    }
    let mut rows = vec![0; points.len()];
    for (row, &key) in (0..).zip(&key_of).polled() {
        let next = &mut ends[key as usize];
        rows[*next as usize] = row;
        *next += 1;
    }
    (rows, columns)
}

fn sorted(points: &[Point], keys: &Keys, threads: usize) -> (Vec<u32>, Vec<Column>) {
    let keyed = sort_by_key(keyed_by(points, threads, |p| keys.of(p)));
    let mut end = 0;
    let column = |run: &[Keyed]| {
        let start = end;
        end += run.len() as u32;
        Column { key: run[0].key, start, end }
    };
    let columns = keyed.chunk_by(|a, b| a.key == b.key).polled().map(column).collect();
    (keyed.into_iter().map(|keyed| keyed.row).collect(), columns)
}
