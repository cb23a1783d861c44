//! First and second moments of points, from exact integer sums that do not depend on their order.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use std::borrow::Borrow;

use crate::fixed::Fixed;
use crate::parallel::map_chunks;
use crate::{Places, Point};

/// Points for a thread at a time. Decides no answer.
const CHUNK: usize = 1 << 14;

/// Integer sums of coordinates and of their products.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Moments {
    count: u32,
    sums: [i128; 3],
    products: [i128; 6],
}

/// The pairs of axes of `products`.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Moments {
    /// The moments of `points`; `fixed` must have been made for them.
    pub(crate) fn of<P: Borrow<Point>>(points: impl IntoIterator<Item = P>, fixed: Fixed) -> Self {
        let mut moments = Self::default();
        points.into_iter().for_each(|p| moments.add(p.borrow().map(|v| fixed.encode(v))));
        moments
    }

    #[inline]
    fn add(&mut self, p: [i64; 3]) {
        self.count += 1;
        (0..3).for_each(|k| self.sums[k] += i128::from(p[k]));
        for (&(a, b), sum) in PAIRS.iter().zip(&mut self.products) {
            *sum += i128::from(p[a]) * i128::from(p[b]); // of two i64: one instruction
        }
    }

    pub(crate) fn merge(mut self, other: &Self) -> Self {
        self.count += other.count;
        (0..3).for_each(|k| self.sums[k] += other.sums[k]);
        (0..6).for_each(|k| self.products[k] += other.products[k]);
        self
    }

    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    pub(crate) fn mean(&self, fixed: Fixed) -> Vector3<f64> {
        Vector3::from_fn(|k, _| fixed.mean(self.sums[k] as f64, self.count))
    }

    /// The axis of least variance and the variance along it; `None` for fewer than three points.
    pub(crate) fn flattest(&self, fixed: Fixed) -> Option<(Vector3<f64>, f64)> {
        if self.count < 3 {
            return None;
        }
        let eigen = SymmetricEigen::new(self.covariance(fixed));
        let least = eigen.eigenvalues.imin();
        Some((eigen.eigenvectors.column(least).into(), eigen.eigenvalues[least].max(0.0)))
    }

    /// The difference of products is computed in integers, so that no digits cancel, however far
    /// the points are from the origin.
    #[allow(clippy::cast_precision_loss)] // the exact value is rounded once, at the end
    fn covariance(&self, fixed: Fixed) -> Matrix3<f64> {
        let n = i128::from(self.count);
        let mut matrix = Matrix3::zeros();
        for (&(a, b), &product) in PAIRS.iter().zip(&self.products) {
            let exact = n * product - self.sums[a] * self.sums[b];
            let value =
                fixed.square(exact as f64) / (f64::from(self.count) * f64::from(self.count));
            matrix[(a, b)] = value;
            matrix[(b, a)] = value;
        }
        matrix
    }
}

/// The mean of points and their mean square distance from it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spread {
    count: u32,
    sums: [i64; 3],
    squares: [i128; 3],
}

impl Spread {
    /// The spread of many points, on several threads.
    pub(crate) fn of_all(points: Places<'_>, fixed: Fixed, threads: usize) -> Self {
        let part = |range: std::ops::Range<usize>| {
            let mut part = Self::default();
            points.within(range).for_each(|p| part.add(p.map(|v| fixed.encode(v))));
            part
        };
        let parts = map_chunks(points.len(), CHUNK, threads, part);
        parts.iter().fold(Self::default(), Self::merge)
    }

    #[inline]
    fn add(&mut self, p: [i64; 3]) {
        self.count += 1;
        for (k, v) in p.into_iter().enumerate() {
            self.sums[k] += v; // `fixed` is made for that
            self.squares[k] += i128::from(v) * i128::from(v);
        }
    }

    fn merge(mut self, other: &Self) -> Self {
        self.count += other.count;
        (0..3).for_each(|k| self.sums[k] += other.sums[k]);
        (0..3).for_each(|k| self.squares[k] += other.squares[k]);
        self
    }

    pub(crate) fn mean(&self, fixed: Fixed) -> Point {
        self.sums.map(|sum| fixed.mean(sum as f64, self.count))
    }

    /// Root mean square distance from the mean, in m; exact up to the last rounding.
    #[allow(clippy::cast_precision_loss)] // the exact value is rounded once, at the end
    pub(crate) fn root_mean_square(&self, fixed: Fixed) -> f64 {
        let (n, count) = (i128::from(self.count), f64::from(self.count));
        let variance = |k: usize| {
            let sum = i128::from(self.sums[k]);
            let exact = n * self.squares[k] - sum * sum;
            fixed.square(exact as f64) / (count * count)
        };
        (variance(0) + variance(1) + variance(2)).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_points_changes_no_bit() {
        let points: Vec<Point> =
            (0..999).map(f64::from).map(|i| [i.sin(), (3.0 * i).cos(), 0.1 * i.cos()]).collect();
        let fixed = Fixed::new(1.0, points.len());
        let forward = Moments::of(&points, fixed);
        let (head, tail) = points.split_at(300);
        let split = Moments::of(tail, fixed).merge(&Moments::of(head.iter().rev(), fixed));
        assert_eq!(forward.flattest(fixed), split.flattest(fixed));
        assert_eq!(forward.mean(fixed), split.mean(fixed));
    }

    #[test]
    fn the_flattest_axis_of_a_slab_is_its_normal() {
        let height = |i: i32| f64::from((i + i / 12) % 2) * 0.02 + 700.0;
        let slab = |i: i32| [f64::from(i % 12), f64::from(i / 12), height(i)];
        let points: Vec<Point> = (0..144).map(slab).collect();
        let fixed = Fixed::new(710.0, 144);
        let (normal, variance) = Moments::of(&points, fixed).flattest(fixed).unwrap();
        assert!(normal.z.abs() > 0.999_99);
        assert!((variance - 0.0001).abs() < 1e-6);
    }
}
