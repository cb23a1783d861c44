//! Extrapolates a surface to a cell by the plane through cells near it (weighted least squares);
//! heights in m.

use nalgebra::{Matrix3, Vector3};

use crate::heightmap::Grid;

/// Places of other cells relative to the middle of one, with their heights.
pub(crate) fn places_about(
    grid: &Grid,
    heights_m: &[f64],
    cell: usize,
    others: impl Iterator<Item = usize>,
) -> Vec<[f64; 3]> {
    let [u, v] = grid.center(cell);
    let place = |other: usize| {
        let [x, y] = grid.center(other);
        [x - u, y - v, heights_m[other]]
    };
    others.map(place).collect()
}

/// The plane through places around the origin, weighted by the inverse square of their distance;
/// `None` if it is not determined.
pub(crate) fn near_plane(about: &[[f64; 3]]) -> Option<Vector3<f64>> {
    let weights = about.iter().map(|p| 1.0 / (p[0] * p[0] + p[1] * p[1]));
    weighted_plane(about, weights, true)
}

/// Height of a plane at a place.
pub(crate) fn value(plane: &Vector3<f64>, p: &[f64; 3]) -> f64 {
    plane[0] + plane[1] * p[0] + plane[2] * p[1]
}

/// The weighted plane through places, level unless `tilted`; `None` if it is not determined.
pub(crate) fn weighted_plane(
    local: &[[f64; 3]],
    weights: impl Iterator<Item = f64>,
    tilted: bool,
) -> Option<Vector3<f64>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let slope = if tilted { 1.0 } else { 0.0 };
    for (p, weight) in local.iter().zip(weights) {
        let row = Vector3::new(1.0, slope * p[0], slope * p[1]);
        matrix += weight * row * row.transpose();
        right += weight * p[2] * row;
    }
    if !tilted {
        return (matrix[(0, 0)] > 0.0).then(|| Vector3::new(right[0] / matrix[(0, 0)], 0.0, 0.0));
    }
    matrix.cholesky().map(|c| c.solve(&right))
}
