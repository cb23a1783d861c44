//! Whether an object can be a pile of bulk material.

use super::patch::{Patch, Zone};

/// No bulk material in use stands steeper than 45° (coal reaches 38°); noise and cell size blur a
/// slope, so only what looks steeper than 60° is called steep.
const STEEP: f64 = 1.732;
/// An object with this share of its rim steep does not lie as poured.
const STEEP_SHARE: f64 = 0.5;

/// Why an object is no pile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Most of its rim drops steeper than any bulk material can lie.
    SteepSides,
    /// It is nowhere three cells wide.
    Thin,
}

/// The reason why the object is no pile, if there is one.
pub(crate) fn why_no_pile(patch: &Patch, above: &[f64], noise_m: f64) -> Option<Reason> {
    if is_thin(patch) {
        return Some(Reason::Thin);
    }
    (steep_share(patch, above, noise_m) > STEEP_SHARE).then_some(Reason::SteepSides)
}

/// The share of the core's rim across which the height drops more than [`STEEP`].
///
/// The drop is taken between the highest and the lowest of the 25 cells around each cell of the
/// rim, less what noise alone makes of it. A rim beyond which nothing was seen says nothing.
fn steep_share(patch: &Patch, above: &[f64], noise_m: f64) -> f64 {
    let diagonal = 4.0 * std::f64::consts::SQRT_2 * patch.grid.cell_m;
    let drop = |cell: usize| {
        let (mut low, mut high, mut outside) = (f64::INFINITY, f64::NEG_INFINITY, false);
        for n in patch.around(cell, 2).filter(|&n| !above[n].is_nan()) {
            (low, high) = (low.min(above[n]), high.max(above[n]));
            outside |= patch.zones[n] != Zone::Core;
        }
        outside.then_some(high - low)
    };
    let drops: Vec<f64> = rim(patch).filter_map(drop).collect();
    let steep = drops.iter().filter(|&&d| d > STEEP * diagonal + 4.0 * noise_m).count();
    to_f64(steep) / to_f64(drops.len().max(1))
}

/// Core cells with a neighbour outside the core, or on the map's edge.
fn rim(patch: &Patch) -> impl Iterator<Item = usize> + '_ {
    let is_core = |&n: &usize| patch.zones[n] == Zone::Core;
    patch.cells(Zone::Core).filter(move |&cell| patch.around(cell, 1).filter(is_core).count() < 9)
}

/// Whether every core cell has a neighbour outside the core: less than three cells wide.
fn is_thin(patch: &Patch) -> bool {
    rim(patch).count() == patch.cells(Zone::Core).count()
}

#[allow(clippy::cast_precision_loss)] // counts of cells
fn to_f64(n: usize) -> f64 {
    n as f64
}
