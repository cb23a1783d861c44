//! Neighbours in a deep cloud: upward through columns.

use std::ops::Range;

use super::{CHUNK, Radius};
use crate::order::{Keyed, keyed_by, sort_by_key};
use crate::parallel::{fill_chunks, map_chunks};
use crate::{Bounds, Point};

/// Columns along an axis, at most: a product of two such numbers is a key.
const MOST_COLUMNS: f64 = 1_073_741_824.0;

#[derive(Debug, Clone, Copy)]
struct Entry {
    point: Point,
    row: u32,
}

/// The place of the entries that share a column.
#[derive(Debug, Clone, Copy)]
struct Column {
    key: u64,
    start: usize,
    end: usize,
}

/// Points sorted into vertical columns at least a radius wide, upward within each.
///
/// Only columns that hold points exist, so a far stray point costs nothing.
pub(super) struct Columns {
    entries: Vec<Entry>,
    columns: Vec<Column>,
    /// From the key of a column to that of the next one in y.
    row_step: u64,
}

impl Columns {
    pub(super) fn new(points: &[Point], bounds: &Bounds, reach: f64, threads: usize) -> Self {
        let (keyed, row_step) = column_keys(points, bounds, reach, threads);
        let keyed = sort_by_key(keyed);
        let mut entries = vec![Entry { point: [0.0; 3], row: 0 }; keyed.len()];
        fill_chunks(&mut entries, CHUNK, threads, |first, piece| {
            for (entry, &Keyed { row, .. }) in piece.iter_mut().zip(&keyed[first..]) {
                *entry = Entry { point: points[row as usize], row };
            }
        });
        let columns = columns_of(&keyed);
        sort_upward(&mut entries, &columns, threads);
        Self { entries, columns, row_step }
    }

    /// Whether each point has enough neighbours.
    pub(super) fn mask(&self, min_neighbors: usize, radius: Radius, threads: usize) -> Vec<bool> {
        let found = map_chunks(self.entries.len(), CHUNK, threads, |range| {
            self.asked(range, min_neighbors, radius)
        });
        let mut mask = vec![false; self.entries.len()];
        for (entry, keep) in self.entries.iter().zip(found.into_iter().flatten()) {
            mask[entry.row as usize] = keep;
        }
        mask
    }

    /// The answer for the entries in `range`, walking from column to column.
    fn asked(&self, range: Range<usize>, min_neighbors: usize, radius: Radius) -> Vec<bool> {
        let first = self.columns.partition_point(|c| c.end <= range.start);
        let reached = self.columns[first..].iter().take_while(|c| c.start < range.end);
        let mut from = self
            .middles(self.columns[first].key)
            .map(|middle| self.columns.partition_point(|c| c.key + 1 < middle));
        let mut mask = Vec::with_capacity(range.len());
        for column in reached {
            let mut windows = self.windows(column, &mut from);
            let asked = column.start.max(range.start)..column.end.min(range.end);
            let asked = self.entries[asked].iter();
            mask.extend(asked.map(|e| windows.hold(min_neighbors + 1, e.point, radius)));
        }
        mask
    }

    /// The middle keys of the three rows of columns around the column `key`.
    fn middles(&self, key: u64) -> [u64; 3] {
        [key, key - self.row_step, key + self.row_step]
    }

    /// The column itself and those around it; `from` follows along each of the three rows.
    fn windows(&self, column: &Column, from: &mut [usize; 3]) -> Windows<'_> {
        let mut windows = Windows::default();
        windows.push(&self.entries[column.start..column.end]);
        for (middle, from) in self.middles(column.key).into_iter().zip(from) {
            *from += self.columns[*from..].iter().take_while(|c| c.key + 1 < middle).count();
            let three = self.columns[*from..].iter().take_while(|c| c.key <= middle + 1);
            for other in three.filter(|c| c.key != column.key) {
                windows.push(&self.entries[other.start..other.end]);
            }
        }
        windows
    }
}

/// What can still matter to a column's points: up to nine columns, its own first.
///
/// The points ask from the lowest upward. Entries too low for one are too low for all that
/// follow, so a window only ever moves up: a wall costs no more than a floor.
#[derive(Default)]
struct Windows<'a> {
    entries: [&'a [Entry]; 9],
    count: usize,
}

impl<'a> Windows<'a> {
    fn push(&mut self, entries: &'a [Entry]) {
        self.entries[self.count] = entries;
        self.count += 1;
    }

    /// Whether `needed` entries, `p` itself among them, lie within the radius of `p`.
    fn hold(&mut self, needed: usize, p: Point, radius: Radius) -> bool {
        let mut found = 0;
        for window in &mut self.entries[..self.count] {
            while window.first().is_some_and(|e| e.point[2] - p[2] < -radius.reach) {
                *window = &window[1..];
            }
            for entry in *window {
                if entry.point[2] - p[2] > radius.reach {
                    break;
                }
                found += usize::from(radius.holds(p, entry.point));
                if found == needed {
                    return true;
                }
            }
        }
        false
    }
}

/// Each row's column, and the step between the keys of one column and the next in y.
///
/// An empty column stands at both ends of a row, so that rows do not touch.
fn column_keys(points: &[Point], bounds: &Bounds, reach: f64, threads: usize) -> (Vec<Keyed>, u64) {
    let extent = bounds.extent();
    let side = reach.max(extent[0].max(extent[1]) / MOST_COLUMNS);
    let cell = |p: &Point, k: usize| ((p[k] - bounds.min[k]) / side) as i64 as u64 + 1; // by i64: faster
    let row_step = (extent[0] / side) as u64 + 3;
    (keyed_by(points, threads, |p| cell(p, 1) * row_step + cell(p, 0)), row_step)
}

fn columns_of(keyed: &[Keyed]) -> Vec<Column> {
    let mut end = 0;
    let runs = keyed.chunk_by(|a, b| a.key == b.key);
    runs.map(|run| {
        end += run.len();
        Column { key: run[0].key, start: end - run.len(), end }
    })
    .collect()
}

fn sort_upward(mut entries: &mut [Entry], columns: &[Column], threads: usize) {
    let mut pieces = Vec::with_capacity(columns.len());
    for column in columns {
        let (piece, rest) = entries.split_at_mut(column.end - column.start);
        pieces.push(piece);
        entries = rest;
    }
    fill_chunks(&mut pieces, CHUNK / 4, threads, |_, pieces| {
        for piece in pieces {
            piece.sort_unstable_by(|a, b| a.point[2].total_cmp(&b.point[2]));
        }
    });
}
