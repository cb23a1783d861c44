//! The radius filter: which points have company.

use std::ops::Range;

use crate::cancel::{Polled, poll};
use crate::error::positive;
use crate::order::{Keyed, keyed_by, sort_by_key};
use crate::parallel::{fill_chunks, map_chunks};
use crate::{Bounds, Point, Result, thread_count};

/// Points that a thread takes at a time.
const CHUNK: usize = 4096;

/// Columns along an axis, at most: a product of two such numbers is a key.
const MOST_COLUMNS: f64 = 1_073_741_824.0;

/// Rounding must not hide a candidate; exact distances alone decide who is a neighbour.
const MARGIN: f64 = 1.0 + 1e-6;

/// Whether each point has at least `min_neighbors` others within `radius_m`.
///
/// A neighbour lies at a distance `<= radius_m`; the point itself does not count, a duplicate of
/// it does. Paper, Algorithm 1, lines 1 to 17, in near-linear time. `threads` = 0 takes every
/// core that the process may use.
///
/// # Errors
/// [`Error::Setting`](crate::Error::Setting) unless `radius_m` is finite and above zero.
///
/// # Examples
///
/// ```
/// use divespot_core::radius_outlier_mask;
///
/// let points = [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [1.0, 1.0, 1.0]];
/// let kept = radius_outlier_mask(&points, 0.05, 2, 0)?;
/// assert_eq!(kept, [true, true, true, false]);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn radius_outlier_mask(
    points: &[Point],
    radius_m: f64,
    min_neighbors: usize,
    threads: usize,
) -> Result<Vec<bool>> {
    positive("radius_m", radius_m)?;
    if min_neighbors == 0 || min_neighbors >= points.len() {
        return Ok(vec![min_neighbors == 0; points.len()]);
    }
    let threads = thread_count(threads);
    let radius = Radius { square: radius_m * radius_m, reach: radius_m * MARGIN };
    let columns = Columns::new(points, radius.reach, threads);
    let found = map_chunks(points.len(), CHUNK, threads, |range| {
        columns.mask(range, min_neighbors, radius)
    });
    let mut mask = vec![false; points.len()];
    for (entry, keep) in columns.entries.iter().zip(found.into_iter().flatten()).polled() {
        mask[entry.row as usize] = keep;
    }
    Ok(mask)
}

#[derive(Debug, Clone, Copy)]
struct Radius {
    square: f64,
    reach: f64,
}

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
struct Columns {
    entries: Vec<Entry>,
    columns: Vec<Column>,
    /// From the key of a column to that of the next one in y.
    row_step: u64,
}

impl Columns {
    fn new(points: &[Point], reach: f64, threads: usize) -> Self {
        let (keyed, row_step) = column_keys(points, reach, threads);
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

    /// The answer for the entries in `range`, walking from column to column.
    fn mask(&self, range: Range<usize>, min_neighbors: usize, radius: Radius) -> Vec<bool> {
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
        poll(); // among points that are all within the radius this takes long
        let mut found = 0;
        for window in &mut self.entries[..self.count] {
            while window.first().is_some_and(|e| e.point[2] - p[2] < -radius.reach) {
                *window = &window[1..];
            }
            for entry in *window {
                let [dx, dy, dz]: Point = std::array::from_fn(|k| entry.point[k] - p[k]);
                if dz > radius.reach {
                    break;
                }
                found += usize::from(dx * dx + dy * dy + dz * dz <= radius.square);
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
fn column_keys(points: &[Point], reach: f64, threads: usize) -> (Vec<Keyed>, u64) {
    let zero = Bounds { min: [0.0; 3], max: [0.0; 3] };
    let bounds = Bounds::of(points.iter().copied()).unwrap_or(zero);
    let extent = bounds.extent();
    let side = reach.max(extent[0].max(extent[1]) / MOST_COLUMNS);
    let cell = |p: &Point, k: usize| ((p[k] - bounds.min[k]) / side) as i64 as u64 + 1; // by i64: faster
    let row_step = (extent[0] / side) as u64 + 3;
    (keyed_by(points, threads, |p| cell(p, 1) * row_step + cell(p, 0)), row_step)
}

fn columns_of(keyed: &[Keyed]) -> Vec<Column> {
    let mut end = 0;
    let runs = keyed.chunk_by(|a, b| a.key == b.key);
    runs.polled()
        .map(|run| {
            end += run.len();
            Column { key: run[0].key, start: end - run.len(), end }
        })
        .collect()
}

fn sort_upward(mut entries: &mut [Entry], columns: &[Column], threads: usize) {
    let mut pieces = Vec::with_capacity(columns.len());
    for column in columns.iter().polled() {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::sample::mix;

    /// The neighbours of each point, counted in all pairs.
    fn slow(points: &[Point], radius: f64) -> Vec<usize> {
        let near = |p: &Point, q: &Point| {
            let [dx, dy, dz] = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            dx * dx + dy * dy + dz * dz <= radius * radius
        };
        points.iter().map(|p| points.iter().filter(|q| near(p, q)).count() - 1).collect()
    }

    /// Points on `levels` levels an axis, a thousandth apart.
    fn cloud(count: u64, levels: [u64; 3]) -> Vec<Point> {
        let coordinate = |i: u64, k: usize| (mix(3 * i + k as u64) % levels[k]) as f64 / 1000.0;
        (0..count).map(|i| std::array::from_fn(|k| coordinate(i, k))).collect()
    }

    fn assert_equal_to_slow(points: &[Point], radius: f64) {
        let counts = slow(points, radius);
        for min_neighbors in [0, 1, 3, 20, 5000] {
            let expected: Vec<bool> = counts.iter().map(|&c| c >= min_neighbors).collect();
            for threads in [1, 3] {
                let found = radius_outlier_mask(points, radius, min_neighbors, threads);
                assert_eq!(found.as_ref(), Ok(&expected), "{radius} {min_neighbors}");
            }
        }
    }

    #[test]
    fn the_mask_is_that_of_all_pairs() {
        for levels in [[300, 200, 20], [1, 1, 1], [2, 1, 4000], [1, 900, 1], [900, 1, 1]] {
            for radius in [1e-9, 0.001, 0.005, 0.0123, 0.05, 2.0] {
                assert_equal_to_slow(&cloud(600, levels), radius);
            }
        }
        // More points than a thread takes at a time, in few columns.
        assert_equal_to_slow(&cloud(4500, [8, 8, 1 << 40]), 0.004);
        assert_equal_to_slow(&[], 1.0);
        assert_equal_to_slow(&[[1.0; 3]], 1.0);
    }

    #[test]
    fn a_point_exactly_on_the_radius_is_a_neighbor() {
        let points = [[0.0; 3], [0.375, 0.5, 0.0], [-0.625, 0.0, 0.0], [0.0, 0.0, 0.625 + 1e-12]];
        let found = radius_outlier_mask(&points, 0.625, 1, 1);
        assert_eq!(found, Ok(vec![true, true, true, false]));
    }

    #[test]
    fn a_far_stray_point_changes_nothing() {
        let mut points = cloud(2000, [200, 200, 10]);
        let mut expected: Vec<bool> = slow(&points, 0.004).into_iter().map(|c| c >= 2).collect();
        points.push([1e9, 1e9, 1e9]);
        expected.push(false);
        assert_eq!(radius_outlier_mask(&points, 0.004, 2, 2), Ok(expected));
    }

    #[test]
    fn a_radius_that_is_none_is_refused() {
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let result = radius_outlier_mask(&[], radius, 1, 1);
            assert!(matches!(result, Err(Error::Setting { name: "radius_m", .. })));
        }
    }
}
