//! Rods and strays that stand in a pile.
//!
//! No bulk material lies steeper than 60°. A cell that rises more steeply than that on two opposite
//! sides is no part of the pile's surface: it is closed like a cell that was not seen. A face that a
//! loader cut rises steeply on one side only, and stays.

use super::patch::{Patch, Zone};
use super::shape::STEEPEST;

/// What is wider than twice this many cells is no rod.
const WIDEST: isize = 4;
/// One direction of each pair of opposite sides.
const AXES: [(isize, isize); 4] = [(1, 0), (0, 1), (1, 1), (1, -1)];

/// The object with the core cells unseen that stand out of it like a rod.
pub(crate) fn without_spikes(mut patch: Patch, margin_m: f64) -> Patch {
    let spikes: Vec<usize> =
        patch.cells(Zone::Core).filter(|&cell| is_spike(&patch, cell, margin_m)).collect();
    spikes.into_iter().for_each(|cell| patch.heights_m[cell] = f64::NAN);
    patch
}

fn is_spike(patch: &Patch, cell: usize, margin_m: f64) -> bool {
    let steep = |dx, dy| rises_from(patch, cell, (dx, dy), margin_m);
    AXES.iter().any(|&(dx, dy)| steep(dx, dy) && steep(-dx, -dy))
}

/// Whether a cell lies too high above one of the object's cells in a direction.
fn rises_from(patch: &Patch, cell: usize, (dx, dy): (isize, isize), margin_m: f64) -> bool {
    let step_m = STEEPEST * patch.grid.cell_m * (dx as f64).hypot(dy as f64);
    (1..=WIDEST).any(|k| {
        let held = |&n: &usize| matches!(patch.zones[n], Zone::Core | Zone::Toe);
        let below = patch.grid.neighbor(cell, k * dx, k * dy).filter(held);
        below.is_some_and(|n| {
            patch.heights_m[cell] - patch.heights_m[n] > margin_m + k as f64 * step_m
        })
    })
}
