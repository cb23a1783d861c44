//! Points relative to an origin, without copying them.

use std::ops::Range;

use crate::parallel::map_chunks;
use crate::{Bounds, Point};

/// Rows for a thread at a time. Decides no answer.
pub(crate) const CHUNK: usize = 32_768;

/// Points and an origin: they read like a copy relative to the origin.
///
/// # Examples
///
/// ```
/// use divespot_core::Places;
/// use divespot_core::sample::sample;
///
/// let far = [[500_000.0, 5_000_000.0, 312.0], [500_001.0, 5_000_000.0, 313.0]];
/// let near = sample(Places::about(&far, far[0]), 2, 0, 1);
/// assert!(near.contains(&[0.0; 3]) && near.contains(&[1.0, 0.0, 1.0]));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Places<'a> {
    points: &'a [Point],
    origin: Point,
}

impl<'a> Places<'a> {
    /// Points relative to `origin`.
    #[must_use]
    pub fn about(points: &'a [Point], origin: Point) -> Self {
        Self { points, origin }
    }

    /// The number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// A copy relative to the origin.
    #[must_use]
    pub fn to_vec(&self) -> Vec<Point> {
        self.iter().collect()
    }

    #[inline]
    pub(crate) fn at(&self, row: usize) -> Point {
        from(self.origin, &self.points[row])
    }

    /// The bounding box; `None` without points.
    pub(crate) fn bounds(&self, threads: usize) -> Option<Bounds> {
        let parts = map_chunks(self.len(), CHUNK, threads, |range| self.ends(range));
        Bounds::of(parts.into_iter().flatten().flatten())
    }

    /// The lowest and the highest coordinates of some rows.
    pub(crate) fn ends(&self, rows: Range<usize>) -> Option<[Point; 2]> {
        let bounds = Bounds::of_row(&self.points[rows])?;
        Some([bounds.min, bounds.max].map(|p| from(self.origin, &p)))
    }

    #[inline]
    pub(crate) fn iter(&self) -> impl Iterator<Item = Point> + use<'a> {
        self.within(0..self.points.len())
    }

    /// The points of some rows.
    #[inline]
    pub(crate) fn within(&self, rows: Range<usize>) -> impl Iterator<Item = Point> + use<'a> {
        let origin = self.origin;
        self.points[rows].iter().map(move |p| from(origin, p))
    }
}

#[inline]
fn from(origin: Point, p: &Point) -> Point {
    std::array::from_fn(|k| p[k] - origin[k])
}

impl<'a, T: AsRef<[Point]> + ?Sized> From<&'a T> for Places<'a> {
    fn from(points: &'a T) -> Self {
        Self { points: points.as_ref(), origin: [0.0; 3] }
    }
}
