//! The radius outlier filter (paper, Algorithm 1, lines 1 to 17): points with few neighbours are
//! outliers.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::cancel::{Polled, poll};
use crate::dealt::{Block, Column, Dealt};
use crate::error::positive;
use crate::parallel::share;
use crate::{Point, Result, thread_count};

/// Search boxes are larger by this factor, so that rounding loses no candidate; exact distances
/// decide.
const MARGIN: f64 = 1.0 + 1e-6;

/// Columns of at most this many points are searched from end to end. Decides no answer.
const FEW: usize = 48;

/// Whether each point has at least `min_neighbors` others within `radius_m`.
///
/// A neighbour is at a distance `<= radius_m`; the point itself does not count, a duplicate of it
/// does. Paper, Algorithm 1, lines 1 to 17, in near-linear time. `threads` = 0 takes every core
/// that the process may use.
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
    let dealt = Dealt::new(points, radius.reach, threads);
    let mask: Vec<AtomicBool> = points.iter().map(|_| AtomicBool::new(false)).collect();
    share(dealt.blocks(threads).into_iter(), threads, |block| {
        let columns = Columns::over(points, &dealt, &block);
        columns.keep(min_neighbors + 1, radius, |row| {
            mask[row as usize].store(true, Ordering::Relaxed);
        });
    });
    Ok(mask.into_iter().map(AtomicBool::into_inner).collect())
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

/// The columns of a block and those around it; if one of them holds many points, each column is
/// sorted by height.
struct Columns {
    entries: Vec<Entry>,
    columns: Vec<Column>,
    is_sorted: bool,
    /// How many columns come before the block's own, and how many are its own.
    before: usize,
    own: usize,
    /// Difference of the keys of two columns next to each other in y.
    row_step: u64,
}

impl Columns {
    fn over(points: &[Point], dealt: &Dealt, block: &Block) -> Self {
        let entry = |&row: &u32| Entry { point: points[row as usize], row };
        let (rows, columns) = dealt.within(&block.around);
        let mut entries: Vec<Entry> = rows.iter().polled().map(entry).collect();
        let is_sorted = columns.iter().any(|column| column.range().len() > FEW);
        for column in columns.iter().polled().filter(|_| is_sorted) {
            let upward = |a: &Entry, b: &Entry| a.point[2].total_cmp(&b.point[2]);
            entries[column.range()].sort_unstable_by(upward);
        }
        Self {
            entries,
            columns,
            is_sorted,
            before: block.own.start - block.around.start,
            own: block.own.len(),
            row_step: dealt.row_step,
        }
    }

    /// Passes on the rows with `needed` entries within the radius, themselves included.
    fn keep(&self, needed: usize, radius: Radius, keep: impl Fn(u32)) {
        let mut from = [0; 3];
        for column in &self.columns[self.before..][..self.own] {
            let mut windows = self.windows(column, &mut from);
            for entry in &self.entries[column.range()] {
                let is_kept = match self.is_sorted {
                    true => windows.hold(needed, entry.point, radius),
                    false => windows.hold_anywhere(needed, entry.point, radius),
                };
                if is_kept {
                    keep(entry.row);
                }
            }
        }
    }

    /// The column itself and those around it; `from` advances along each of the three rows.
    fn windows(&self, column: &Column, from: &mut [usize; 3]) -> Windows<'_> {
        let mut windows = Windows::default();
        windows.push(&self.entries[column.range()]);
        let key = column.key;
        for (middle, from) in [key, key - self.row_step, key + self.row_step].into_iter().zip(from)
        {
            *from += self.columns[*from..].iter().take_while(|c| c.key + 1 < middle).count();
            let three = self.columns[*from..].iter().take_while(|c| c.key <= middle + 1);
            for other in three.filter(|c| c.key != key) {
                windows.push(&self.entries[other.range()]);
            }
        }
        windows
    }
}

/// The entries that can still be neighbours of a column's points: up to nine columns, its own
/// first.
///
/// The points are processed from the lowest up. Entries too low for one are too low for all that
/// follow, so a window only moves upwards, and a wall takes no longer than a floor.
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

    /// The same for entries that are not sorted.
    fn hold_anywhere(&self, needed: usize, p: Point, radius: Radius) -> bool {
        let mut found = 0;
        for window in &self.entries[..self.count] {
            for entry in *window {
                found += usize::from(square(&entry.point, &p) <= radius.square);
                if found == needed {
                    return true;
                }
            }
        }
        false
    }

    /// Whether `needed` entries, including `p`, lie within the radius of `p`.
    fn hold(&mut self, needed: usize, p: Point, radius: Radius) -> bool {
        poll(); // among points that are all within the radius this takes long
        let mut found = 0;
        for window in &mut self.entries[..self.count] {
            while window.first().is_some_and(|e| e.point[2] - p[2] < -radius.reach) {
                *window = &window[1..];
            }
            for entry in *window {
                if entry.point[2] - p[2] > radius.reach {
                    break;
                }
                found += usize::from(square(&entry.point, &p) <= radius.square);
                if found == needed {
                    return true;
                }
            }
        }
        false
    }
}

#[inline]
fn square(p: &Point, q: &Point) -> f64 {
    let [dx, dy, dz]: Point = std::array::from_fn(|k| p[k] - q[k]);
    dx * dx + dy * dy + dz * dz
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::sample::mix;

    /// Number of neighbours of each point, from all pairs.
    fn slow(points: &[Point], radius: f64) -> Vec<usize> {
        let near = |p: &Point, q: &Point| {
            let [dx, dy, dz] = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
            dx * dx + dy * dy + dz * dz <= radius * radius
        };
        points.iter().map(|p| points.iter().filter(|q| near(p, q)).count() - 1).collect()
    }

    /// Points on `levels` levels for each axis, 1 mm apart.
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
