//! Walks the surface from the ground (a filter limited by slope, after Vosselman 2000); heights
//! in m.
//!
//! From the ground, the surface of bulk material can be reached without a step steeper than
//! material stands (60°). From cells of known height the walk goes to their neighbours, best
//! agreement first, and takes those of a neighbour's points that are within reach of the height
//! expected there. Points that hang, stand or fly over the surface are out of reach, and so are
//! points below it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::columns::{Columns, Needs};
use crate::cancel::poll;
use crate::connectivity::FOUR;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;

/// The noise lies within this many standard deviations: 99.7 % of a normal distribution.
pub(crate) const SIGMAS: f64 = 3.0;
/// Largest change of the surface's slope within a cell, as rise over run: 17°. Chosen on the scenes
/// of `divespot evaluate`.
const BEND: f64 = 0.3;

/// Extends known heights (NaN where unknown) cell by cell over the columns.
///
/// Cells are settled in the order of their agreement with the settled cells around; ties go to the
/// cell with the lower index. The walk ends where points rise from a cell, at the foot of a face.
pub(crate) fn walk(columns: &Columns, heights_m: &mut [f64], needs: &Needs, reach: Reach) {
    let is_open = |cell: usize| columns.grid.neighbors(cell, &FOUR).any(|n| heights_m[n].is_nan());
    let ends = (0..heights_m.len()).filter(|&cell| !heights_m[cell].is_nan() && is_open(cell));
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> = ends.map(|c| Reverse((0, c))).collect();
    while let Some(Reverse((_, cell))) = queue.pop() {
        poll();
        for n in columns.grid.neighbors(cell, &FOUR) {
            if !heights_m[n].is_nan() {
                continue;
            }
            let expected = expected_from(&columns.grid, heights_m, n, cell, reach.far_m);
            let near = columns.between(n, expected - reach.far_m, expected + reach.far_m);
            if near.len() >= needs.of(n) {
                heights_m[n] = mean(near);
                if columns.rises(n, heights_m[n], reach.far_m).is_none() {
                    queue.push(Reverse(((heights_m[n] - expected).abs().to_bits(), n)));
                }
            }
        }
    }
}

/// How far a point may lie from the height expected in its cell, in m.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// Rise of the steepest material within a cell, plus noise.
    pub(crate) far_m: f64,
    /// Bend of the surface within a cell, plus noise.
    pub(crate) near_m: f64,
}

impl Reach {
    pub(crate) fn of(cell_m: f64, noise_m: f64) -> Self {
        let noise_m = SIGMAS * noise_m;
        Self { far_m: NEVER_STEEPER * cell_m + noise_m, near_m: BEND * cell_m + noise_m }
    }
}

/// Mean height of the settled cells around one that lie on the surface the walk comes from.
fn expected_from(grid: &Grid, heights_m: &[f64], cell: usize, from: usize, reach_m: f64) -> f64 {
    let known = grid.around(cell, 1).map(|n| heights_m[n]);
    let same = known.filter(|h| (h - heights_m[from]).abs() <= 2.0 * reach_m);
    let (sum, count) = same.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
    sum / count
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
