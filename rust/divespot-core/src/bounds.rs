//! The bounding boxes of points; coordinates in m.

use crate::parallel::map_chunks;
use crate::{Point, thread_count};

/// Rows that a thread looks at twice: they stay in its cache. Decides no answer.
const LOOKED_AT: usize = 4096;
/// Numbers compared side by side: the coordinates of four points. Decides no answer.
const ABREAST: usize = 12;

/// An axis-aligned box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Point,
    /// Largest coordinates.
    pub max: Point,
}

impl Bounds {
    /// The bounding box of `points`; `None` without points.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = points.next()?;
        let (min, max) = ends(points, first, first);
        Some(Self { min, max })
    }

    /// The box around a row of points, several of which are compared side by side.
    pub(crate) fn of_row(points: &[Point]) -> Option<Self> {
        let first = points.first()?;
        let mut low: [f64; ABREAST] = std::array::from_fn(|k| first[k % 3]);
        let mut high = low;
        let (blocks, _) = points.as_flattened().as_chunks::<ABREAST>();
        for block in blocks {
            for ((low, high), &v) in low.iter_mut().zip(&mut high).zip(block) {
                *low = if v < *low { v } else { *low };
                *high = if v > *high { v } else { *high };
            }
        }
        let rest = &points[blocks.len() * (ABREAST / 3)..];
        let ends = low.as_chunks().0.iter().chain(high.as_chunks().0);
        Self::of(ends.chain(rest).copied())
    }

    /// The bounding box of all points; `None` without points, or if one is not finite.
    #[must_use]
    pub fn of_finite(points: &[Point], threads: usize) -> Option<Self> {
        let parts = map_chunks(points.len(), LOOKED_AT, thread_count(threads), |range| {
            let points = &points[range];
            // Without an early exit the loop is vectorised.
            let finite = points.as_flattened().iter().fold(true, |all, v| all & v.is_finite());
            finite.then(|| Self::of_row(points)).flatten()
        });
        let parts = parts.into_iter().collect::<Option<Vec<_>>>()?;
        Self::of(parts.into_iter().flat_map(|b| [b.min, b.max]))
    }

    /// The lengths of the box's edges.
    #[must_use]
    pub fn extent(&self) -> Point {
        std::array::from_fn(|k| self.max[k] - self.min[k])
    }

    /// The largest absolute coordinate.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.min.iter().chain(&self.max).fold(0.0, |most, v| v.abs().max(most))
    }
}

/// The lowest and highest coordinates of `low`, `high` and the points. Comparisons with NaN are
/// false, so NaN is ignored.
#[inline]
pub(crate) fn ends(points: impl Iterator<Item = Point>, low: Point, high: Point) -> (Point, Point) {
    // Plain comparisons: `f64::min` handles NaN at several times the cost.
    points.fold((low, high), |(low, high), p| {
        let lower = |k: usize| if p[k] < low[k] { p[k] } else { low[k] };
        let higher = |k: usize| if p[k] > high[k] { p[k] } else { high[k] };
        (std::array::from_fn(lower), std::array::from_fn(higher))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_around_a_row_is_that_around_its_points() {
        let at = |i: usize, k: usize| ((i * 37 + k * 11) % 23) as f64 - 11.0;
        for count in 0..30 {
            let points: Vec<Point> = (0..count).map(|i| [0, 1, 2].map(|k| at(i, k))).collect();
            assert_eq!(Bounds::of_row(&points), Bounds::of(points.iter().copied()), "{count}");
            assert_eq!(Bounds::of_finite(&points, 2), Bounds::of(points.iter().copied()));
            for row in 0..count {
                let mut points = points.clone();
                points[row][row % 3] = f64::NAN;
                assert_eq!(Bounds::of_finite(&points, 1), None);
            }
        }
    }
}
