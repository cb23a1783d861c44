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

#[cfg(test)]
mod tests {
    use super::super::tests::{exact, measured};

    fn cone(x: f64, y: f64) -> f64 {
        (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0)
    }

    #[test]
    fn a_rod_in_a_pile_is_closed_and_counted() {
        let rod = |x: f64, y: f64| (x - 4.3).abs() < 0.1 && (y - 3.2).abs() < 0.1;
        let height = |x, y| if rod(x, y) { 2.0 } else { cone(x, y) };
        let object = measured(&exact(height), |x, y| cone(x, y) > 0.05).remove(0);
        let whole = std::f64::consts::PI * 1.44 * 0.6 / 3.0;
        assert!((object.volume.net_m3() / whole - 1.0).abs() < 0.01, "{:?}", object.volume);
        assert!(object.seen_fraction < 1.0 && object.reason.is_none());
    }

    #[test]
    fn a_cut_face_stays() {
        let cut = |x: f64, y: f64| if x < 4.2 { cone(x, y) } else { 0.0 };
        let object = measured(&exact(cut), |x, y| cut(x, y) > 0.05).remove(0);
        assert!((object.seen_fraction - 1.0).abs() < 1e-12, "{object:?}");
    }
}
