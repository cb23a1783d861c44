//! Whether an object can be a pile of bulk material.

use super::patch::{Patch, Zone};
use super::wall;
use crate::material::NEVER_STEEPER;

/// Poured material runs out to the ground. The rim of what stands clear of the ground is therefore
/// low: at most this share of the object's height.
const LOW: f64 = 0.35;
/// An object with this share of its rim high does not lie as poured.
const HIGH_SHARE: f64 = 0.5;
/// The object's height is the one that this share of its cells stays below.
const TOP: f64 = 0.95;

/// Why an object is no pile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// Most of its rim stands high, or it is high and slender: no bulk material lies so steep.
    SteepSides,
    /// It is nowhere three cells wide.
    Thin,
    /// Its summit borders the shadow of something steep: haze, or a pile that is half hidden.
    Shadow,
    /// The surface was seen below it.
    Floating,
    /// It hangs together with no surface that can be walked from the ground.
    Apart,
    /// Too little of it was seen for a volume that could be answered for.
    TooLittleSeen,
    /// It runs out of the scan on most sides, or is walled in, and no ground was seen around it.
    CutOff,
    /// Its volume is not clear of its own uncertainty, or its mean height not of the margin within
    /// which the ground lies.
    NotClear,
}

/// The reason why the object is no pile, if there is one.
pub(crate) fn why_no_pile(patch: &Patch, above: &[f64], margin_m: f64) -> Option<Reason> {
    if patch.rim().count() == patch.cells(Zone::Core).count() {
        return Some(Reason::Thin);
    }
    let top = top(patch, above);
    // No pile is higher than this for the radius of a disc as large as it is: a rod with a skirt of
    // flying pixels is.
    if top > NEVER_STEEPER * radius(patch) {
        return Some(Reason::SteepSides);
    }
    let low = (LOW * top).max(2.0 * margin_m);
    let high = |&cell: &usize| above[cell] > low;
    let tells = |&cell: &usize| sees_outside(patch, above, cell) && !wall::is_beside(patch, cell);
    let seen: Vec<usize> = patch.rim().filter(tells).collect();
    let share = seen.iter().filter(|cell| high(cell)).count() as f64 / seen.len().max(1) as f64;
    (share > HIGH_SHARE).then_some(Reason::SteepSides)
}

/// Whether something was seen just beyond a rim cell; where not, the object may go on.
fn sees_outside(patch: &Patch, above: &[f64], cell: usize) -> bool {
    patch.around(cell, 2).any(|n| patch.zones[n] != Zone::Core && !above[n].is_nan())
}

/// The radius of a disc as large as the core.
fn radius(patch: &Patch) -> f64 {
    let cells = patch.cells(Zone::Core).count() as f64;
    (cells / std::f64::consts::PI).sqrt() * patch.grid.cell_m
}

fn top(patch: &Patch, above: &[f64]) -> f64 {
    let core = patch.cells(Zone::Core).map(|cell| above[cell]);
    let mut heights: Vec<f64> = core.filter(|h| !h.is_nan()).collect();
    let index = (TOP * heights.len() as f64) as usize;
    if index >= heights.len() {
        return 0.0;
    }
    *heights.select_nth_unstable_by(index, f64::total_cmp).1
}
