//! The ring of ground around an object, thinned out for fits of its form.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::count::to_f64;
use crate::robust::scale;

/// Nodes along the longer side of the ring, at most.
const NODES: f64 = 24.0;
/// Cells for each square of the ring's rectangle; about half of the squares lie on the ring.
const CELLS: f64 = 3.0;

/// The ring's cells gathered into squares, each weighted by the root of their number.
pub(crate) struct Nodes {
    pub(crate) places: Vec<[f64; 2]>,
    pub(crate) roots: DVector<f64>,
    pub(crate) heights: DVector<f64>,
    /// Longer side of the ring's rectangle.
    pub(crate) size_m: f64,
    /// Edge of a node's square.
    pub(crate) step_m: f64,
    /// Standard deviation of a cell about the middle of its node.
    pub(crate) noise_m: f64,
}

impl Nodes {
    pub(crate) fn of(ring: &[[f64; 3]]) -> Self {
        let range = |k: usize| {
            let ends = ring.iter().map(|p| p[k]);
            (ends.clone().fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max))
        };
        let (x, y) = (range(0), range(1));
        let size_m = (x.1 - x.0).max(y.1 - y.0).max(f64::MIN_POSITIVE);
        let step_m = size_m / (to_f64(ring.len()) / CELLS).sqrt().clamp(1.0, NODES);
        let mut cells: BTreeMap<(usize, usize), Vec<[f64; 3]>> = BTreeMap::new();
        for p in ring {
            let key = (((p[0] - x.0) / step_m) as usize, ((p[1] - y.0) / step_m) as usize);
            cells.entry(key).or_default().push(*p);
        }
        let mut off = Vec::new();
        let (mut places, mut roots, mut heights) = (Vec::new(), Vec::new(), Vec::new());
        for cells in cells.values() {
            let count = to_f64(cells.len());
            let middle = middle(cells.iter().map(|p| p[2]).collect());
            off.extend(cells.iter().map(|p| p[2] - middle));
            places.push([0, 1].map(|k| cells.iter().map(|p| p[k]).sum::<f64>() / count));
            roots.push(count.sqrt());
            heights.push(count.sqrt() * middle);
        }
        let noise_m = scale(off);
        Self { places, roots: roots.into(), heights: heights.into(), size_m, step_m, noise_m }
    }

    /// The weighted values of a function at the nodes.
    pub(crate) fn values(&self, function: impl Fn(f64, f64) -> f64) -> DVector<f64> {
        let value = |i: usize| self.roots[i] * function(self.places[i][0], self.places[i][1]);
        DVector::from_fn(self.places.len(), |i, _| value(i))
    }

    /// Orthonormal columns that span the weighted values of functions at the nodes; `None` where
    /// there are too few nodes.
    pub(crate) fn basis(&self, functions: impl Fn(f64, f64) -> Vec<f64>) -> Option<DMatrix<f64>> {
        let rows: Vec<Vec<f64>> = self.places.iter().map(|p| functions(p[0], p[1])).collect();
        let width = rows.first()?.len();
        let matrix =
            DMatrix::from_fn(rows.len(), width, |row, column| self.roots[row] * rows[row][column]);
        (rows.len() > 2 * width).then(|| matrix.qr().q())
    }

    /// The middle of each node.
    pub(crate) fn points(&self) -> Vec<[f64; 3]> {
        let point = |(i, p): (usize, &[f64; 2])| [p[0], p[1], self.heights[i] / self.roots[i]];
        self.places.iter().enumerate().map(point).collect()
    }

    /// The nodes that are `kept`.
    pub(crate) fn kept(&self, kept: impl Fn(usize) -> bool) -> Self {
        let all: Vec<usize> = (0..self.places.len()).filter(|&i| kept(i)).collect();
        let those = |values: &DVector<f64>| DVector::from_fn(all.len(), |i, _| values[all[i]]);
        Self {
            places: all.iter().map(|&i| self.places[i]).collect(),
            roots: those(&self.roots),
            heights: those(&self.heights),
            ..*self
        }
    }

    /// Height at the centre and slopes of the plane that fits the nodes best when `other` lies on it.
    pub(crate) fn plane_under(&self, other: impl Fn(f64, f64) -> f64) -> Option<[f64; 3]> {
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (i, &[x, y]) in self.places.iter().enumerate() {
            let row = Vector3::new(1.0, x, y) * self.roots[i];
            matrix += row * row.transpose();
            right += row * (self.heights[i] - self.roots[i] * other(x, y));
        }
        matrix.cholesky().map(|c| c.solve(&right).into())
    }
}

/// The median, between the two middle ones of an even number: of few values the upper is too high.
fn middle(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let half = values.len() / 2;
    0.5 * (values[half] + values[values.len().div_ceil(2) - 1])
}

/// The part of `values` that lies across all columns of an orthonormal basis.
pub(crate) fn without(basis: &DMatrix<f64>, values: &DVector<f64>) -> DVector<f64> {
    values - basis * basis.tr_mul(values)
}
