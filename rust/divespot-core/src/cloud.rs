//! A point cloud near a local origin; coordinates in m.

use std::ops::Range;

use crate::bounds::ends;
use crate::parallel::{map_chunks, share, split_by};
use crate::places::CHUNK;
use crate::{Bounds, Point, thread_count};

/// The finite points of a scan, relative to the lowest corner of their bounding box.
///
/// At 5,000,000 m (UTM) the resolution of an `f32` is 0.5 m, and that of a square in `f64`
/// 0.004 m². Relative to a corner of the cloud both are fine enough.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// The offset that was subtracted from every point, in m.
    pub origin: Point,
    /// The edges of the bounding box of `points`, in m.
    pub extent_m: Point,
    /// The finite points, in the order given.
    pub points: Vec<Point>,
    /// The input row of each of `points`; `None` if every row was finite.
    pub rows: Option<Vec<u32>>,
}

impl Cloud {
    /// Takes the finite rows among `count` and moves them near the origin.
    ///
    /// The origin is the lowest corner of the bounding box. It does not depend on the order of the
    /// points, moves with them, and keeps coordinates exact that are exact in binary. `threads` = 0
    /// takes every core that the process may use; each row is read twice.
    ///
    /// # Examples
    ///
    /// ```
    /// use divespot_core::Cloud;
    ///
    /// let rows = [[500_000.0, 5_000_000.0, 312.0], [f64::NAN; 3], [500_001.0, 5_000_002.0, 313.0]];
    /// let cloud = Cloud::new(rows.len(), 1, |row| rows[row]);
    /// assert_eq!(cloud.origin, [500_000.0, 5_000_000.0, 312.0]);
    /// assert_eq!(cloud.points, [[0.0; 3], [1.0, 2.0, 1.0]]);
    /// assert_eq!(cloud.rows, Some(vec![0, 2]));
    /// ```
    #[must_use]
    pub fn new(count: usize, threads: usize, row: impl Fn(usize) -> Point + Sync) -> Self {
        let threads = thread_count(threads);
        let finite = |p: &Point| p.iter().all(|v| v.is_finite());
        let looks = map_chunks(count, CHUNK, threads, |range| {
            let mut kept = 0;
            let points = range.clone().map(&row).filter(finite).inspect(|_| kept += 1);
            (Bounds::of(points), Stretch { range, kept })
        });
        let (bounds, parts): (Vec<_>, Vec<_>) = looks.into_iter().unzip();
        let bounds = Bounds::of(bounds.into_iter().flatten().flat_map(|b| [b.min, b.max]));
        let origin = bounds.map_or([0.0; 3], |b| b.min);
        Self {
            origin,
            extent_m: bounds.map_or([0.0; 3], |b| b.extent()),
            points: gather(&parts, threads, |range| {
                range.map(&row).filter(finite).map(move |p| centred(p, origin))
            }),
            rows: parts.iter().any(|part| part.kept < part.range.len()).then(|| {
                let is_kept = |i: &usize| finite(&row(*i));
                gather(&parts, threads, |range| range.filter(is_kept).map(|i| i as u32))
            }),
        }
    }

    /// Takes the usable rows among `count`. Rows that are not finite, or (0, 0, 0), a depth
    /// camera's mark for a pixel without depth, are counted and dropped.
    #[must_use]
    pub fn seen(count: usize, threads: usize, row: impl Fn(usize) -> Point + Sync) -> Seen {
        let blank = |p: Point| if p == [0.0; 3] { [f64::NAN; 3] } else { p };
        let zeros = map_chunks(count, CHUNK, thread_count(threads), |range| {
            range.filter(|&i| row(i) == [0.0; 3]).count()
        });
        let zero = zeros.into_iter().sum();
        let cloud = match zero {
            0 => Self::new(count, threads, row),
            _ => Self::new(count, threads, |i| blank(row(i))),
        };
        Seen { nonfinite: count - zero - cloud.points.len(), zero, cloud }
    }

    /// Spreads one value for each point over the input's rows; dropped rows get `missing`.
    #[must_use]
    pub fn spread<T: Copy>(&self, values: Vec<T>, missing: T, count: usize) -> Vec<T> {
        let Some(rows) = &self.rows else { return values };
        let mut out = vec![missing; count];
        rows.iter().zip(values).for_each(|(&row, value)| out[row as usize] = value);
        out
    }
}

/// The lowest and highest coordinates of some rows, and how many rows share the lowest and highest
/// z. NaN is ignored; if all values are NaN, so is the result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outermost {
    /// Lowest coordinates.
    pub low: Point,
    /// Highest coordinates.
    pub high: Point,
    /// Rows with the lowest z.
    pub lowest: usize,
    /// Rows with the highest z.
    pub highest: usize,
}

impl Outermost {
    /// Of no rows.
    const NOTHING: Self =
        Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3], lowest: 0, highest: 0 };

    /// Looks at `count` rows; `threads` = 0 takes every core that the process may use.
    #[must_use]
    pub fn of(count: usize, threads: usize, row: impl Fn(usize) -> Point + Sync) -> Self {
        let parts = map_chunks(count, CHUNK, thread_count(threads), |range| {
            let rows = range.clone().map(&row);
            let (low, high) = ends(rows, Self::NOTHING.low, Self::NOTHING.high);
            let held = |at: f64, z: f64| usize::from(z == at);
            let (lowest, highest) =
                range.map(|i| row(i)[2]).fold((0, 0), |(lowest, highest), z| {
                    (lowest + held(low[2], z), highest + held(high[2], z))
                });
            Self { low, high, lowest, highest }
        });
        let all = parts.into_iter().fold(Self::NOTHING, Self::and);
        let known = |k: usize| all.low[k] <= all.high[k];
        let or_nan =
            |ends: Point| std::array::from_fn(|k| if known(k) { ends[k] } else { f64::NAN });
        Self { low: or_nan(all.low), high: or_nan(all.high), ..all }
    }

    fn and(self, other: Self) -> Self {
        let (low, _) = ends(std::iter::once(other.low), self.low, self.high);
        let (_, high) = ends(std::iter::once(other.high), self.low, self.high);
        let held = |at: f64, own: f64, count: usize| if own == at { count } else { 0 };
        Self {
            low,
            high,
            lowest: held(low[2], self.low[2], self.lowest)
                + held(low[2], other.low[2], other.lowest),
            highest: held(high[2], self.high[2], self.highest)
                + held(high[2], other.high[2], other.highest),
        }
    }
}

/// Rows read by one thread, and how many of them it keeps.
struct Stretch {
    range: Range<usize>,
    kept: usize,
}

/// The items that `take` keeps of each part, in order.
fn gather<T: Copy + Default + Send, I: Iterator<Item = T>>(
    parts: &[Stretch],
    threads: usize,
    take: impl Fn(Range<usize>) -> I + Sync,
) -> Vec<T> {
    let mut out = vec![T::default(); parts.iter().map(|part| part.kept).sum()];
    let pieces = split_by(&mut out, parts.iter().map(|part| part.kept));
    share(pieces.into_iter().zip(parts), threads, |(piece, part)| {
        piece.iter_mut().zip(take(part.range.clone())).for_each(|(slot, value)| *slot = value);
    });
    out
}

fn centred(p: Point, origin: Point) -> Point {
    std::array::from_fn(|k| p[k] - origin[k])
}

/// The usable points of a scan, and how many rows were dropped.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// The usable points.
    pub cloud: Cloud,
    /// Rows with a coordinate that is not finite.
    pub nonfinite: usize,
    /// Rows of (0, 0, 0).
    pub zero: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn non_finite_rows_are_left_out_and_found_again() {
        let rows = [[1.0, 2.0, 3.0], [f64::NAN, 0.0, 0.0], [5.0, 2.0, 3.0], [f64::INFINITY; 3]];
        let cloud = Cloud::new(4, 1, |i| rows[i]);
        assert_eq!(cloud.origin, [1.0, 2.0, 3.0]);
        assert_eq!(cloud.points, [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]);
        assert_eq!(cloud.spread(vec![7, 8], -1, 4), [7, -1, 8, -1]);
    }

    #[test]
    fn threads_do_not_count() {
        let row = |i: usize| [i as f64, if i % 7 == 3 { f64::NAN } else { 0.5 }, -(i as f64)];
        let count = 2 * CHUNK + 5;
        let cloud = Cloud::new(count, 3, row);
        assert_eq!(cloud, Cloud::new(count, 1, row));
        let rows: Vec<u32> = (0..count as u32).filter(|i| i % 7 != 3).collect();
        assert_eq!(cloud.points.len(), rows.len());
        assert_eq!(cloud.rows, Some(rows));
    }

    #[test]
    fn the_outermost_are_counted_and_what_is_no_number_is_not() {
        let rows =
            [[1.0, f64::NAN, 3.0], [2.0, f64::NAN, -4.0], [f64::NAN; 3], [0.0, f64::NAN, 3.0]];
        for threads in [1, 2] {
            let found = Outermost::of(4, threads, |i| rows[i]);
            assert_eq!((found.low[0], found.high[0]), (0.0, 2.0));
            assert_eq!(
                (found.low[2], found.high[2], found.lowest, found.highest),
                (-4.0, 3.0, 1, 2)
            );
            assert!(found.low[1].is_nan() && found.high[1].is_nan());
        }
    }

    #[test]
    fn blank_pixels_are_counted_and_left_out() {
        let rows = [[0.0, -0.0, 0.0], [1.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0], [0.0; 3]];
        let seen = Cloud::seen(4, 1, |i| rows[i]);
        assert_eq!((seen.nonfinite, seen.zero, seen.cloud.points.len()), (1, 2, 1));
    }

    #[test]
    fn an_offset_of_five_million_metres_changes_nothing() {
        let rows: Vec<Point> =
            (0..99).map(|i| [f64::from(i) / 64.0, 0.25, f64::from(i * i)]).collect();
        let shift = [482_310.0, 5_456_790.0, 312.0];
        let near = Cloud::new(99, 1, |i| rows[i]);
        let far = Cloud::new(99, 1, |i| std::array::from_fn(|k| rows[i][k] + shift[k]));
        assert_eq!(near.points, far.points);
    }

    #[test]
    fn empty_and_single_clouds_are_no_trap() {
        assert!(Cloud::new(0, 1, |_| [0.0; 3]).points.is_empty());
        let one = Cloud::new(1, 1, |_| [1e300, -4.0, 0.1]);
        assert_eq!(one.points, [[0.0; 3]]);
    }
}
