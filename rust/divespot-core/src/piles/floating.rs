//! Things that hang in the air.
//!
//! What stands on the ground hides the ground below it. Where the ground was seen below most of an
//! object, from another side or through it, the object floats: a lamp, the arm of a crane, a veil
//! of flying pixels. What lies between it and the ground is air.

use super::flat_top::points_over;
use super::{Object, Reason};
use crate::Point;
use crate::count::to_f64;
use crate::heightmap::Grid;

/// An object floats if the ground was seen below this share of its cells: aslant, it is seen below
/// a box's rim as well.
const BELOW: f64 = 0.5;
/// Lower cells, in margins, may hold points of the ground and of a pile's toe alike.
const HIGH: f64 = 4.0;

/// Gives the reason to every object that floats.
pub(crate) fn mark(grid: &Grid, points: &[Point], objects: &mut [Object], margin_m: f64) {
    let mut candidates: Vec<&mut Object> = objects
        .iter_mut()
        .filter(|o| matches!(o.reason, None | Some(Reason::SteepSides)))
        .collect();
    let lowest = lowest(grid, &points_over(grid, points, candidates.iter().map(|o| &**o)));
    for object in &mut candidates {
        let high: Vec<&[f64; 3]> =
            object.covers_m.iter().filter(|p| p[2] > HIGH * margin_m).collect();
        let sees_ground =
            |p: &[f64; 3]| lowest[grid.cell(p)] - object.base.at([p[0], p[1]]) <= margin_m;
        let below = high.iter().filter(|p| sees_ground(p)).count();
        if to_f64(below) > BELOW * to_f64(high.len()) {
            object.reason = Some(Reason::Floating);
        }
    }
}

/// The lowest of the points in each cell; infinite where there is none.
fn lowest(grid: &Grid, points: &[(usize, Point)]) -> Vec<f64> {
    let mut lowest = vec![f64::INFINITY; grid.len()];
    for &(cell, p) in points {
        if p[2] < lowest[cell] {
            lowest[cell] = p[2];
        }
    }
    lowest
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, settings};
    use super::super::{Reason, measure};
    use crate::Point;
    use crate::heightmap::height_map;

    /// A board 0.8 above a floor, which is seen below it where `below` says so.
    fn reason(below: impl Fn(f64, f64) -> bool) -> Option<Reason> {
        let at = |i: i32| (f64::from(i) + 0.5) * CELL / 3.0;
        let board = |x: f64, y: f64| (3.0..5.0).contains(&x) && (2.0..3.5).contains(&y);
        let plan = (0..384 * 288).map(|i| (at(i % 384), at(i / 384)));
        let on_floor = plan.clone().filter(|&(x, y)| !board(x, y) || below(x, y));
        let mut points: Vec<Point> = on_floor.map(|(x, y)| [x, y, 0.0]).collect();
        points.extend(plan.filter(|&(x, y)| board(x, y)).map(|(x, y)| [x, y, 0.8]));
        let map = height_map(&points, CELL).unwrap();
        let labels: Vec<i32> =
            map.heights_m.iter().map(|&h| if h > 0.05 { 0 } else { -1 }).collect();
        let found = measure(&map.grid, &map.heights_m, &labels, &points, &settings()).unwrap();
        found[0].reason
    }

    #[test]
    fn a_board_with_ground_seen_below_floats_and_a_box_does_not() {
        assert_eq!(reason(|_, _| true), Some(Reason::Floating));
        assert_eq!(reason(|_, _| false), Some(Reason::SteepSides));
        // Aslant, the floor is seen below the edge.
        assert_eq!(reason(|x, _| x > 4.7), Some(Reason::SteepSides));
    }
}
