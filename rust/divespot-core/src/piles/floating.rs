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
/// there. Chosen: half way up; lower keeps floating things, higher takes a box's own sides for the
/// surface below.
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

#[cfg(test)]
mod tests {
    use super::super::base::Base;
    use super::super::tests::{exact, measured};
    use super::*;
    use crate::Point;
    use crate::connectivity::UNLABELLED;

    /// Whether something 1 m high floats, over whose cells ten points each lie off the surface, and so
    /// many on the surface, at a height.
    fn floats(below: usize, height_m: f64) -> bool {
        let cone = |x: f64, y: f64| (1.0 - (x - 4.0).hypot(y - 3.0)).max(0.0);
        let map = exact(cone);
        let mut object = measured(&map, |x, y| cone(x, y) > 0.03).remove(0);
        object.base = Base::ground(0.0, 0.0, 0.0);
        object.covers_m.iter_mut().for_each(|p| p[2] = 1.0);
        let over = |count: usize, z: f64| -> Vec<Point> {
            object.covers_m.iter().flat_map(|p| vec![[p[0], p[1], z]; count]).collect()
        };
        let found = Found {
            surface: over(below, height_m).into(),
            loose: over(10, 1.0),
            ..Found::on_all_else(vec![UNLABELLED; map.grid.len()])
        };
        let mut objects = [object];
        mark(&map.grid, &found, &mut objects);
        objects[0].reason == Some(Reason::Floating)
    }

    #[test]
    fn what_shows_half_as_many_points_below_it_as_it_has_itself_floats() {
        assert!(floats(7, 0.0) && !floats(3, 0.0));
    }

    #[test]
    fn the_surface_lies_below_it_where_it_is_less_than_half_as_high() {
        assert!(floats(10, 0.4) && !floats(10, 0.7));
    }
}
