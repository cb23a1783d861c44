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
/// A rim beyond which nothing was seen says nothing.
fn steep_share(patch: &Patch, above: &[f64], noise_m: f64) -> f64 {
    let steep = |cell: usize| {
        let steepest = [1, 2].map(|reach| is_steep(patch, above, noise_m, cell, reach));
        steepest.into_iter().flatten().reduce(|a, b| a || b)
    };
    let rim: Vec<bool> = rim(patch).filter_map(steep).collect();
    to_f64(rim.iter().filter(|&&steep| steep).count()) / to_f64(rim.len().max(1))
}

/// Whether the highest and the lowest cell up to `reach` cells away differ by more than a slope
/// and noise can make them; `None` where nothing outside the core is seen.
///
/// A sharp edge shows between next neighbours, one that the sensor blurs a cell further.
fn is_steep(patch: &Patch, above: &[f64], noise_m: f64, cell: usize, reach: u8) -> Option<bool> {
    let (mut low, mut high, mut outside) = (f64::INFINITY, f64::NEG_INFINITY, false);
    for n in patch.around(cell, reach.into()).filter(|&n| !above[n].is_nan()) {
        (low, high) = (low.min(above[n]), high.max(above[n]));
        outside |= patch.zones[n] != Zone::Core;
    }
    let diagonal = 2.0 * f64::from(reach) * std::f64::consts::SQRT_2 * patch.grid.cell_m;
    outside.then_some(high - low > STEEP * diagonal + 4.0 * noise_m)
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
