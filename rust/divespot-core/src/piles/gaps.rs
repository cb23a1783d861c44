//! Heights of cells that were not seen, and how well they are known.

use super::hidden::{Edge, Flank, Rim, open, rims};
use super::patch::{Patch, Zone};
use super::repose::Repose;
use crate::film::{Node, relax};
use crate::hypotenuse::Hypotenuse;

/// Standard deviation of what lies anywhere within one of the middle (GUM 4.3.7).
pub(crate) const ANYWHERE: f64 = 0.577;

/// Mean square, as a root, of what lies above a flank at most as high as the line of sight, and the
/// less likely the higher (a triangular distribution with its mode at the flank; GUM 4.3.9).
const BELOW_SIGHT: f64 = 0.408;

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
    let gaps = gaps(patch, above);
    if gaps.is_empty() {
        return Filled { above_m: above.to_vec(), u_m3: 0.0 };
    }
    let hidden = Hidden::behind(patch, above);
    let sight_m3 = hidden.below_sight_m3(patch);
    let (filled, film) = closed(patch, above, gaps, &hidden);
    // The surface lies between the film and the lowest that the material can stand.
    let share = |cell: usize| patch.counted(cell).share;
    let slack = film.iter().map(|&c| share(c) * (filled[c] - hidden.above_m[c]).abs());
    let u_film_m3 = ANYWHERE * slack.sum::<f64>() * patch.grid.cell_m * patch.grid.cell_m;
    Filled {
        u_m3: u_film_m3.hypotenuse(hidden.u_m3()).hypotenuse(BELOW_SIGHT * sight_m3),
        above_m: filled,
    }
}

/// The heights of [`fill`] alone, for about half the work.
pub(crate) fn heights(patch: &Patch, above: &[f64]) -> Vec<f64> {
    let gaps = gaps(patch, above);
    if gaps.is_empty() {
        return above.to_vec();
    }
    closed(patch, above, gaps, &Hidden::behind(patch, above)).0
}

/// The unseen cells of an object.
fn gaps(patch: &Patch, above: &[f64]) -> Vec<usize> {
    let held = |&cell: &usize| matches!(patch.zones[cell], Zone::Core | Zone::Toe);
    (0..above.len()).filter(|&cell| above[cell].is_nan()).filter(held).collect()
}

/// The heights with the gaps closed, and the gaps that a film was stretched across.
fn closed(
    patch: &Patch,
    above: &[f64],
    mut gaps: Vec<usize>,
    hidden: &Hidden<'_>,
) -> (Vec<f64>, Vec<usize>) {
    let mut filled = above.to_vec();
    for &cell in &gaps {
        if patch.beyond[cell] || hidden.covers(cell) {
            filled[cell] = hidden.above_m[cell];
        }
    }
    gaps.retain(|&cell| filled[cell].is_nan());
    stretch(patch, &mut filled, &gaps);
    (filled, gaps)
}

/// How flanks run down from what was seen of an object.
struct Flanks<'a> {
    patch: &'a Patch,
    above: &'a [f64],
    core: Vec<usize>,
    repose: Repose,
}

impl<'a> Flanks<'a> {
    fn of(patch: &'a Patch, above: &'a [f64]) -> Self {
        let core: Vec<usize> = patch.cells(Zone::Core).collect();
        let repose = Repose::of(&patch.grid, &core, |cell| above[cell]);
        Self { patch, above, core, repose }
    }

    fn unseen(&self, cell: usize) -> bool {
        self.above[cell].is_nan() && !self.patch.beyond[cell] && !self.patch.bars[cell]
    }

    fn rims(&self, edge: Edge) -> Vec<Rim> {
        let object = self.core.iter().map(|&cell| (cell, 0));
        let above = |_, cell: usize| self.above[cell];
        rims(&self.patch.grid, object, edge, above, |cell| self.unseen(cell))
    }

    /// The heights of the flanks from these rims, `times` the uncertainty of the slope steeper.
    fn down(&self, rims: &[Rim], times: f64) -> Vec<f64> {
        let slope = |_| self.repose.steeper(times);
        Flank::down(&self.patch.grid, rims, slope, |cell| self.unseen(cell)).above_m
    }
}

/// The flanks that nobody saw.
struct Hidden<'a> {
    flanks: Flanks<'a>,
    /// Whether a cell lies in a shadow that is open to the ground.
    open: Vec<bool>,
    /// The rims that are sure.
    sure: Vec<Rim>,
    /// The lowest that the material can stand above the base, from either edge; 0 where none need be.
    sure_m: Vec<f64>,
    crest_m: Vec<f64>,
    /// Their mean.
    above_m: Vec<f64>,
}

impl<'a> Hidden<'a> {
    fn behind(patch: &'a Patch, above: &'a [f64]) -> Self {
        let flanks = Flanks::of(patch, above);
        let core = |cell: usize| patch.zones[cell] == Zone::Core;
        let open = open(&patch.grid, |cell| flanks.unseen(cell), core);
        let sure = flanks.rims(Edge::Sure);
        let sure_m = flanks.down(&sure, 0.0);
        let rise_m = flanks.repose.slope * patch.grid.cell_m;
        let crest_m = flanks.down(&flanks.rims(Edge::Crest { rise_m }), 0.0);
        let above_m = sure_m.iter().zip(&crest_m).map(|(low, high)| 0.5 * (low + high)).collect();
        Self { flanks, open, sure, sure_m, crest_m, above_m }
    }

    fn covers(&self, cell: usize) -> bool {
        self.open[cell] && self.above_m[cell] > 0.0
    }

    /// The volume in the shadow between the flanks and the line of sight over the crest: a film
    /// across the shadow ends where that line meets the ground.
    fn below_sight_m3(&self, patch: &Patch) -> f64 {
        let hidden = |&cell: &usize| self.flanks.unseen(cell) && self.open[cell];
        let held: Vec<usize> = patch.held().filter(hidden).collect();
        if held.is_empty() {
            return 0.0;
        }
        let mut sight_m = self.flanks.above.to_vec();
        let shadow: Vec<usize> =
            (0..sight_m.len()).filter(|&cell| self.flanks.unseen(cell)).collect();
        stretch(patch, &mut sight_m, &shadow);
        let slack = held.iter().map(|&cell| (sight_m[cell] - self.above_m[cell]).max(0.0));
        slack.sum::<f64>() * patch.grid.cell_m * patch.grid.cell_m
    }

    /// Standard uncertainty of the volume of the hidden flanks.
    fn u_m3(&self) -> f64 {
        let sum = |high: &[f64], low: &[f64]| {
            let behind = (0..self.open.len()).filter(|&cell| self.open[cell]);
            behind.map(|cell| high[cell] - low[cell]).sum::<f64>()
        };
        let steeper = |times: f64| self.flanks.down(&self.sure, times);
        let u_angle = 0.5 * sum(&steeper(-1.0), &steeper(1.0));
        let u_rim = 0.5 * ANYWHERE * sum(&self.crest_m, &self.sure_m);
        let cell_m = self.flanks.patch.grid.cell_m;
        u_angle.hypotenuse(u_rim) * cell_m * cell_m
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
