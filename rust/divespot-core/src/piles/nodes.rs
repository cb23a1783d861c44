//! The annulus of ground around an object, averaged in squares for the fits of breakline and
//! kriging.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::count::to_f64;
use crate::robust::scale;

/// Most squares along the longer side of the annulus. Chosen: it bounds the time of the fits; fewer
/// widen the places of folds and steps.
const NODES: f64 = 24.0;
/// Cells for each square of the bounding rectangle; the annulus fills about half of the squares,
/// with six cells each. Chosen: fewer give no median, more blur breaks.
const CELLS: f64 = 3.0;

/// The median height of the annulus in each square; rows are weighted by the root of the number of
/// cells.
pub(crate) struct Nodes {
    pub(crate) places: Vec<[f64; 2]>,
    pub(crate) roots: DVector<f64>,
    pub(crate) heights: DVector<f64>,
    /// Longer side of the annulus's bounding rectangle, in m.
    pub(crate) size_m: f64,
    /// Width of a square, in m.
    pub(crate) step_m: f64,
    /// Standard deviation of a cell about the height of its square, in m.
    pub(crate) noise_m: f64,
}

impl Nodes {
    pub(crate) fn of(annulus: impl Iterator<Item = [f64; 3]> + Clone) -> Self {
        let range = |k: usize| {
            let ends = annulus.clone().map(|p| p[k]);
            (ends.clone().fold(f64::INFINITY, f64::min), ends.fold(f64::NEG_INFINITY, f64::max))
        };
        let (x, y) = (range(0), range(1));
        let size_m = (x.1 - x.0).max(y.1 - y.0).max(f64::MIN_POSITIVE);
        let step_m = size_m / (to_f64(annulus.clone().count()) / CELLS).sqrt().clamp(1.0, NODES);
        let mut squares: BTreeMap<(usize, usize), Square> = BTreeMap::new();
        for p in annulus {
            let key = (((p[0] - x.0) / step_m) as usize, ((p[1] - y.0) / step_m) as usize);
            squares.entry(key).or_default().add(p);
        }
        let mut off = Vec::new();
        let (mut places, mut roots, mut heights) = (Vec::new(), Vec::new(), Vec::new());
        for Square { sums, heights: cells } in squares.into_values() {
            let count = to_f64(cells.len());
            let middle = middle_of(cells.clone());
            off.extend(cells.iter().map(|height| height - middle));
            places.push(sums.map(|sum| sum / count));
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

    /// Orthonormal basis of the weighted functions at the nodes (QR); `None` with too few nodes.
    pub(crate) fn basis(&self, functions: impl Fn(f64, f64) -> Vec<f64>) -> Option<DMatrix<f64>> {
        let rows: Vec<Vec<f64>> = self.places.iter().map(|p| functions(p[0], p[1])).collect();
        let width = rows.first()?.len();
        let matrix =
            DMatrix::from_fn(rows.len(), width, |row, column| self.roots[row] * rows[row][column]);
        (rows.len() > 2 * width).then(|| matrix.qr().q())
    }

    /// Mean place and height of each node.
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

    /// Height at the centre and slopes of the plane that fits the nodes best after `other` is
    /// subtracted.
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

/// The cells of one square: the sums of their x and y, and their heights.
#[derive(Default)]
struct Square {
    sums: [f64; 2],
    heights: Vec<f64>,
}

impl Square {
    fn add(&mut self, [x, y, height]: [f64; 3]) {
        self.sums = [self.sums[0] + x, self.sums[1] + y];
        self.heights.push(height);
    }
}

/// The median, interpolated between the two middle values: with few values the upper one is biased.
fn middle_of(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let half = values.len() / 2;
    0.5 * (values[half] + values[values.len().div_ceil(2) - 1])
}

/// `values` less their projection onto an orthonormal basis.
pub(crate) fn without(basis: &DMatrix<f64>, values: &DVector<f64>) -> DVector<f64> {
    values - basis * basis.tr_mul(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_holds_three_cells_and_there_are_24_along_a_side_at_most() {
        // Squares of so many cells along a side; a side is one shorter than their middles are.
        let along = |side: i32| {
            let at = |i: i32| [f64::from(i % side), f64::from(i / side), 0.0];
            let nodes = Nodes::of((0..side * side).map(at));
            nodes.size_m / nodes.step_m
        };
        assert!((along(30) - 30.0 / 3.0_f64.sqrt()).abs() < 1e-9, "{}", along(30));
        assert!((along(90) - 24.0).abs() < 1e-9, "{}", along(90));
    }
}
