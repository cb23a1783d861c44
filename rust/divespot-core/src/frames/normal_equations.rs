//! Normal equations of poses, with the height of every surfel eliminated (Schur complement).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Most unknowns of one observation.
pub(crate) const WIDTH: usize = 7;

/// An observation of a surfel's height: `off + row · x[first..first + len]`, for unknowns `x`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) first: usize,
    pub(crate) len: usize,
    pub(crate) row: [f64; WIDTH],
    pub(crate) off: f64,
    pub(crate) weight: f64,
}

/// `matrix · x = right`.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations {
    matrix: DMatrix<f64>,
    right: DVector<f64>,
}

impl NormalEquations {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { matrix: DMatrix::zeros(unknowns, unknowns), right: DVector::zeros(unknowns) }
    }

    /// Adds the observations of one surfel, whose own height is free.
    pub(crate) fn add_surfel(&mut self, rows: &[Row]) {
        let weight: f64 = rows.iter().map(|r| r.weight).sum();
        let mean = rows.iter().map(|r| r.weight * r.off).sum::<f64>() / weight;
        for (i, a) in rows.iter().enumerate() {
            self.block(a, a, a.weight - a.weight * a.weight / weight);
            for b in &rows[..i] {
                self.block(a, b, -a.weight * b.weight / weight);
            }
            let pull = a.weight * (a.off - mean);
            (0..a.len).for_each(|k| self.right[a.first + k] -= pull * a.row[k]);
        }
    }

    /// Adds `factor · aᵀ b` below the diagonal.
    #[inline]
    fn block(&mut self, a: &Row, b: &Row, factor: f64) {
        let (low, high) = if a.first >= b.first { (a, b) } else { (b, a) };
        let rows = self.right.len();
        for k in 0..high.len {
            let by = factor * high.row[k];
            let start = (high.first + k) * rows + low.first;
            let column = &mut self.matrix.as_mut_slice()[start..start + low.len];
            column.iter_mut().zip(&low.row).for_each(|(sum, one)| *sum += by * one);
        }
    }

    /// Adds the equations of other observations of the same unknowns.
    pub(crate) fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.right += &other.right;
    }

    /// Adds a prior: the unknown, or its difference from another, is `-off`, with a weight.
    pub(crate) fn add_prior(&mut self, one: usize, other: Option<usize>, off: f64, weight: f64) {
        self.matrix[(one, one)] += weight;
        self.right[one] -= weight * off;
        if let Some(other) = other {
            self.matrix[(other, other)] += weight;
            self.matrix[(one.max(other), one.min(other))] -= weight;
            self.right[other] += weight * off;
        }
    }

    /// The solution; `None` if the equations do not determine it.
    pub(crate) fn solved(self) -> Option<Solved> {
        let factor = Cholesky::new(self.matrix)?;
        let x = factor.solve(&self.right);
        x.iter().all(|v| v.is_finite()).then_some(Solved { x, factor })
    }
}

/// A solution and its covariance.
pub(crate) struct Solved {
    pub(crate) x: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
}

impl Solved {
    /// The variance of a linear combination of the unknowns, if weights are inverse variances.
    pub(crate) fn variance(&self, combination: &DVector<f64>) -> f64 {
        combination.dot(&self.factor.solve(combination))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(first: usize, row: &[f64], off: f64, weight: f64) -> Row {
        let mut held = [0.0; WIDTH];
        held[..row.len()].copy_from_slice(row);
        Row { first, len: row.len(), row: held, off, weight }
    }

    #[test]
    fn it_solves_what_a_system_with_the_heights_in_it_solves() {
        let surfels: Vec<Vec<Row>> = (0..12)
            .map(|i| {
                let s = f64::from(i);
                vec![
                    row(0, &[1.0, s.sin()], 0.1 * s, 2.0),
                    row(2, &[0.5 - s, 1.0], s.cos(), 1.0 + s),
                    row(4, &[1.0, s * s * 0.1], 0.3, 0.5),
                ]
            })
            .collect();
        let mut small = NormalEquations::new(6);
        surfels.iter().for_each(|rows| small.add_surfel(rows));
        (0..6).for_each(|k| small.add_prior(k, None, 0.01, 0.3));
        small.add_prior(5, Some(1), 0.2, 0.7);
        let found = small.solved().unwrap();

        let mut all = DMatrix::zeros(18, 18);
        let mut right = DVector::zeros(18);
        for (i, rows) in surfels.iter().enumerate() {
            for r in rows {
                let mut full = DVector::zeros(18);
                (0..r.len).for_each(|k| full[r.first + k] = r.row[k]);
                full[6 + i] = -1.0;
                all += &full * full.transpose() * r.weight;
                right -= full * (r.weight * r.off);
            }
        }
        for k in 0..6 {
            all[(k, k)] += 0.3;
            right[k] -= 0.3 * 0.01;
        }
        let mut tie = DVector::zeros(18);
        tie[5] = 1.0;
        tie[1] = -1.0;
        all += &tie * tie.transpose() * 0.7;
        right -= tie * (0.7 * 0.2);
        let inverse = all.clone().try_inverse().unwrap();
        let slow = &inverse * right;
        assert!((found.x.clone() - slow.rows(0, 6)).norm() < 1e-9);
        let mut one = DVector::zeros(6);
        one[3] = 1.0;
        assert!((found.variance(&one) - inverse[(3, 3)]).abs() < 1e-9);
    }
}
