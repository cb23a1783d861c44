//! Things that hang in the air.
//!
//! What stands on the ground hides the ground below it. Where the surface was seen below most of an
//! object, from another side or through it, the object floats: a lamp, the arm of a crane, a veil
//! of flying pixels. What lies between it and the surface is air.

use super::{Object, Reason};
use crate::count::to_f64;
use crate::heightmap::Grid;

/// An object floats if the surface was seen below this share of its cells: aslant, it is seen below
/// a box's rim as well.
const BELOW: f64 = 0.5;
/// The surface lies below an object where it is lower by more than this share of its height.
const LOWER: f64 = 0.5;

/// Gives the reason to every object that floats above a surface of these heights.
pub(crate) fn mark(grid: &Grid, surface_m: &[f64], objects: &mut [Object]) {
    for object in objects {
        let lower = |p: &&[f64; 3]| {
            let above_m = surface_m[grid.cell(&p[..])] - object.base.at([p[0], p[1]]);
            above_m < LOWER * p[2]
        };
        let below = object.covers_m.iter().filter(lower).count();
        if to_f64(below) > BELOW * to_f64(object.covers_m.len()) {
            object.reason = Some(Reason::Floating);
        }
    }
}
