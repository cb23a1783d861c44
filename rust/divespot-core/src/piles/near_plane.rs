//! How a surface goes on at a cell: as the plane through cells near it.

use nalgebra::Vector3;

use super::base::{Kind, weighted_plane};
use crate::heightmap::Grid;

/// Places from the middle of a cell to those of others, and the heights there.
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

/// The plane through places about one, the nearest counting most; `None` where they tell of none.
pub(crate) fn near_plane(about: &[[f64; 3]]) -> Option<Vector3<f64>> {
    let weights = about.iter().map(|p| 1.0 / (p[0] * p[0] + p[1] * p[1]));
    weighted_plane(about, weights, Kind::Ring)
}
