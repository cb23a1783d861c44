//! Finds objects that hang in the air: a lamp, a crane's arm, a veil of flying pixels.
//!
//! An object that stands on the ground hides the ground below it. If the surface below an object
//! was seen about as well as the object itself, the object floats, and the space between is air.

use super::flat_top::points_over;
use super::found::Found;
use super::object::Object;
use super::reason::Reason;
use crate::heightmap::Grid;

/// An object floats if the surface below it has at least this share of its own number of points. In
/// an oblique view a few are seen below the rim of a box too. Chosen on the scenes of `divespot
/// evaluate`.
const BELOW: f64 = 0.5;
/// A point of the surface is below an object if it is lower than this share of the object's height
/// there. Chosen.
const LOWER: f64 = 0.5;

/// Gives the reason to every object that floats above the surface.
pub(crate) fn mark(grid: &Grid, found: &Found, objects: &mut [Object]) {
    if objects.is_empty() {
        return;
    }
    let mut surface = points_over(grid, found.surface.iter(), objects.iter());
    let mut loose = points_over(grid, found.loose.iter(), objects.iter());
    for over in [&mut surface, &mut loose] {
        over.retain(|(_, p)| grid.holds(p));
    }
    for object in objects {
        let mut high_m = vec![f64::NAN; grid.len()];
        object.covers_m.iter().for_each(|p| high_m[grid.cell(p)] = p[2]);
        let above_m = |p: &[f64; 3]| p[2] - object.base.at([p[0], p[1]]);
        let own_surface = surface.iter().filter(|(cell, _)| !high_m[*cell].is_nan());
        let below = own_surface.filter(|(cell, p)| above_m(p) < LOWER * high_m[*cell]).count();
        let own = loose.iter().filter(|(cell, _)| !high_m[*cell].is_nan()).count();
        if below as f64 > BELOW * own as f64 {
            object.reason = Some(Reason::Floating);
        }
    }
}
