//! Heights of cells that were not seen, and how well they are known.

use super::hidden::{Edge, Flank, open, rims};
use super::patch::{Patch, Zone};
use super::repose::Repose;
use crate::film::{Node, relax};

/// Standard deviation of what lies anywhere within one of the middle (GUM 4.3.7).
const ANYWHERE: f64 = 0.577;

/// Heights above the base with the gaps closed.
pub(crate) struct Filled {
    pub(crate) above_m: Vec<f64>,
    /// Standard uncertainty of the volume in the cells that were filled.
    pub(crate) u_m3: f64,
}

/// Closes the unseen cells of an object.
///
/// In the shadow behind it the flank runs down at the angle of repose; a gap that it encloses, or
/// one between its toe and the ground, is crossed as a soap film would. What lies beyond the scan
/// is not counted.
pub(crate) fn fill(patch: &Patch, above: &[f64]) -> Filled {
    let held = |&cell: &usize| matches!(patch.zones[cell], Zone::Core | Zone::Toe);
    let gaps: Vec<usize> =
        (0..above.len()).filter(held).filter(|&cell| above[cell].is_nan()).collect();
    if gaps.is_empty() {
        return Filled { above_m: above.to_vec(), u_m3: 0.0 };
    }
    let hidden = Hidden::behind(patch, above);
    let mut filled = above.to_vec();
    for &cell in &gaps {
        if patch.beyond[cell] || hidden.covers(cell) {
            filled[cell] = hidden.above_m[cell];
        }
    }
    let film: Vec<usize> = gaps.into_iter().filter(|&cell| filled[cell].is_nan()).collect();
    stretch(patch, &mut filled, &film);
    // The surface lies between the film and the lowest that the material can stand.
    let share = |cell: usize| patch.counted(cell).share;
    let slack = film.iter().map(|&c| share(c) * (filled[c] - hidden.above_m[c]).abs());
    let u_film_m3 = ANYWHERE * slack.sum::<f64>() * patch.grid.cell_m * patch.grid.cell_m;
    Filled { u_m3: u_film_m3.hypot(hidden.u_m3), above_m: filled }
}

/// The flanks that nobody saw.
struct Hidden {
    /// Whether a cell lies in a shadow that is open to the ground.
    open: Vec<bool>,
    /// The lowest that the material can stand, above the base; 0 where none need be.
    above_m: Vec<f64>,
    /// Standard uncertainty of the volume of the hidden flanks.
    u_m3: f64,
}

impl Hidden {
    fn behind(patch: &Patch, above: &[f64]) -> Self {
        let grid = &patch.grid;
        let unseen = |cell: usize| above[cell].is_nan() && !patch.beyond[cell];
        let core: Vec<usize> = patch.cells(Zone::Core).collect();
        let open = open(grid, unseen, |cell| patch.zones[cell] == Zone::Core);
        let repose = Repose::of(grid, &core, |cell| above[cell]);
        let run = |edge, times| {
            let object = core.iter().map(|&cell| (cell, 0));
            let rims = rims(grid, object, edge, |_, cell| above[cell], unseen);
            Flank::down(grid, &rims, |_| repose.steeper(times), unseen).above_m
        };
        let sum = |high: &[f64], low: &[f64]| {
            let behind = (0..open.len()).filter(|&cell| open[cell]);
            behind.map(|cell| high[cell] - low[cell]).sum::<f64>()
        };
        let rise_m = repose.slope * grid.cell_m;
        let (low, high) = (run(Edge::Sure, 0.0), run(Edge::Crest { rise_m }, 0.0));
        let u_angle = 0.5 * sum(&run(Edge::Sure, -1.0), &run(Edge::Sure, 1.0));
        let u_rim = 0.5 * ANYWHERE * sum(&high, &low);
        let above_m = low.iter().zip(&high).map(|(low, high)| 0.5 * (low + high)).collect();
        let u_m3 = u_angle.hypot(u_rim) * grid.cell_m * grid.cell_m;
        Self { open, above_m, u_m3 }
    }

    fn covers(&self, cell: usize) -> bool {
        self.open[cell] && self.above_m[cell] > 0.0
    }
}

/// Stretches a film across the cells of `gap`.
fn stretch(patch: &Patch, filled: &mut [f64], gap: &[usize]) {
    let known = filled.iter().filter(|h| !h.is_nan());
    let largest = known.fold(0.0_f64, |most, h| most.max(h.abs()));
    gap.iter().for_each(|&cell| filled[cell] = 0.0);
    let nodes: Vec<Node> = gap.iter().map(|&cell| Node::free(cell)).collect();
    relax(filled, patch.grid.columns, &nodes, largest);
}
