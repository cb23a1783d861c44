//! One surface, walked from the ground.
//!
//! Bulk material lies: from the ground its surface can be reached without a step steeper than
//! material stands. So from cells whose height is known the walk goes to their neighbours, best
//! agreement first, and takes of a neighbour's points those within reach of the height expected
//! there. What hangs, stands or flies over the surface is out of reach, and so is what lies below.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::columns::Columns;
use crate::cancel::poll;
use crate::connectivity::FOUR;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;

/// Standard deviations within which a sensor's noise lies.
pub(crate) const SIGMAS: f64 = 3.0;
/// What the surface's slope changes by within a cell.
const BEND: f64 = 0.3;

/// Extends known heights (NaN where none is) cell by cell over the columns.
///
/// Cells are settled in the order in which they agree with the cells around that are settled; of
/// equal ones the first cell goes first. Where points rise from a cell, at the foot of a face, the walk
/// ends.
pub(crate) fn walk(columns: &Columns, heights_m: &mut [f64], needs: &[u32], reach: Reach) {
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> =
        (0..heights_m.len()).filter(|&c| !heights_m[c].is_nan()).map(|c| Reverse((0, c))).collect();
    while let Some(Reverse((_, cell))) = queue.pop() {
        poll();
        for n in columns.grid.neighbors(cell, &FOUR) {
            if !heights_m[n].is_nan() {
                continue;
            }
            let expected = expected(&columns.grid, heights_m, n, cell, reach.far_m);
            let near = columns.between(n, expected - reach.far_m, expected + reach.far_m);
            if near.len() >= needs[n] as usize {
                heights_m[n] = mean(near);
                if columns.rises(n, heights_m[n], reach.far_m).is_none() {
                    queue.push(Reverse(((heights_m[n] - expected).abs().to_bits(), n)));
                }
            }
        }
    }
}

/// How far a point may lie from the height that is expected in its cell.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reach {
    /// As the steepest material rises within a cell.
    pub(crate) far_m: f64,
    /// As the surface bends within a cell.
    pub(crate) near_m: f64,
}

impl Reach {
    pub(crate) fn of(cell_m: f64, noise_m: f64) -> Self {
        let noise_m = SIGMAS * noise_m;
        Self { far_m: NEVER_STEEPER * cell_m + noise_m, near_m: BEND * cell_m + noise_m }
    }
}

/// The mean height of the settled cells around one that lie on the same surface as that from which
/// the walk comes.
fn expected(grid: &Grid, heights_m: &[f64], cell: usize, from: usize, reach_m: f64) -> f64 {
    let known = grid.around(cell, 1).map(|n| heights_m[n]);
    let same = known.filter(|h| (h - heights_m[from]).abs() <= 2.0 * reach_m);
    let (sum, count) = same.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
    sum / count
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
