//! Walls that continue below a pile which is higher than they are.
//!
//! A wall that enters the pile on one side and leaves it on another, or two walls whose lines cross
//! below it, is continued there with its height and width. Its volume is not material. Where the
//! pile is as high as the wall, the wall's top cannot be told from the pile's surface. Lengths
//! in m.

use super::axis::{dot, main_axis};
use super::nearest_label::NearestLabel;
use super::window::{Window, Zone};
use crate::connectivity::EIGHT;
use crate::connectivity::components;
use crate::count::to_f64;
use crate::robust::median;

/// A wall's line is fitted to its part within this many cells of the pile. Chosen: less tells its
/// direction badly, more follows walls that bend away from the pile.
const NEAR: u32 = 12;
/// The fewest cells for the direction of a wall. Chosen: with fewer, a post has a direction; more
/// loses short ends of walls.
const FEWEST: usize = 12;
/// Walls whose directions differ by less than this are one straight wall: the sine of 20°. Chosen:
/// lower parts walls seen badly, higher joins walls that meet at an angle.
const TURN: f64 = 0.34;
/// A straight wall fills at least this share of the rectangle around its cells. Two walls that meet
/// at a corner fill less. Cells where the pile covers the wall do not count. Chosen: lower takes
/// corners for walls, higher loses walls with gaps.
const FULL: f64 = 0.5;
/// A pile that is lower than the wall by this share of a cell's width does not cover it. Chosen:
/// half a cell, by which a slope of 45° varies within half a cell; lower loses walls just covered,
/// higher buries walls that stand free.
const LOWER: f64 = 0.5;
/// Standard uncertainty of a wall's width, in cells: each of its two sides runs anywhere through a
/// cell (rectangular distribution, GUM 4.3.7), √(2/12).
const SIDES: f64 = 0.408;

/// A cell below which a wall continues, with the height of the wall's top in m.
#[derive(Clone)]
pub(super) struct Buried {
    pub(super) cell: usize,
    pub(super) top_m: f64,
    /// Standard uncertainty of the wall's volume in the cell, as a share of its height.
    pub(super) u_share: f64,
}

/// The cells below which walls continue.
pub(super) fn buried(window: &Window) -> Vec<Buried> {
    let walls = walls_near(window);
    let pairs = (0..walls.len()).flat_map(|i| (0..i).map(move |k| (i, k)));
    let joined = pairs.flat_map(|(i, k)| between(window, &walls[i], &walls[k]));
    let all = walls.iter().flat_map(|wall| below(window, wall, wall.ends));
    all.chain(joined).collect()
}

/// The straight walls within [`NEAR`] cells of an object.
fn walls_near(window: &Window) -> Vec<Wall> {
    let is_wall = |cell: usize| !window.wall_tops_m[cell].is_nan();
    if !(0..window.zones.len()).any(is_wall) {
        return Vec::new();
    }
    let core = |zone: &Zone| if *zone == Zone::Core { 0 } else { -1 };
    let labels: Vec<i32> = window.zones.iter().map(core).collect();
    let near = NearestLabel::grow(&window.grid, &labels, |_| true, NEAR).owner;
    let cells = (0..near.len()).map(|cell| near[cell] == 0 && is_wall(cell)).collect();
    let pieces = components(&window.grid, cells, &EIGHT);
    let walls = pieces.iter().filter_map(|piece| Wall::of(window, piece));
    walls.filter(|wall| wall.is_straight(window.grid.cell_m)).collect()
}

/// A straight piece of wall in plan.
struct Wall {
    middle: [f64; 2],
    along: [f64; 2],
    /// Its ends, in m along its direction from its middle.
    ends: [f64; 2],
    width_m: f64,
    top_m: f64,
    places: Vec<[f64; 2]>,
}

impl Wall {
    fn of(window: &Window, cells: &[usize]) -> Option<Self> {
        let places = cells.iter().map(|&cell| window.grid.center(cell)).collect();
        let tops = cells.iter().map(|&cell| window.wall_tops_m[cell]).collect();
        Self::through(places, median(tops), window.grid.cell_m)
    }

    fn through(places: Vec<[f64; 2]>, top_m: f64, cell_m: f64) -> Option<Self> {
        let count = to_f64(places.len());
        let (middle, along) = main_axis(places.iter().copied());
        let at = places.iter().map(|p| dot(along, less(*p, middle)));
        let ends = at.fold([0.0_f64; 2], |[low, high], s| [low.min(s), high.max(s)]);
        let across = places.iter().map(|p| dot([-along[1], along[0]], less(*p, middle)).powi(2));
        // Width of an evenly spread set, from its variance: √(12 · variance), plus the width of a
        // cell.
        let width_m = (12.0 * across.sum::<f64>() / count + cell_m * cell_m).sqrt();
        let wall = Self { middle, along, ends, width_m, top_m, places };
        (wall.places.len() >= FEWEST).then_some(wall)
    }

    fn off(&self, p: [f64; 2]) -> f64 {
        let [x, y] = less(p, self.middle);
        (self.along[0] * y - self.along[1] * x).abs()
    }

    fn at(&self, p: [f64; 2]) -> f64 {
        dot(self.along, less(p, self.middle))
    }

    /// Whether the wall is longer than twice its width and fills its rectangle. Two walls that meet
    /// at a corner do not.
    fn is_straight(&self, cell_m: f64) -> bool {
        let length_m = self.ends[1] - self.ends[0] + cell_m;
        let area_m2 = to_f64(self.places.len()) * cell_m * cell_m;
        length_m > 2.0 * self.width_m && area_m2 > FULL * length_m * self.width_m
    }

    /// The stretch of the wall's line from its end nearer to `p` to `beyond_m` past `p`; empty if
    /// `p` lies within the wall.
    fn up_to(&self, p: [f64; 2], beyond_m: f64) -> [f64; 2] {
        let at = self.at(p);
        if at > self.ends[1] {
            [self.ends[1], at + beyond_m]
        } else if at < self.ends[0] {
            [at - beyond_m, self.ends[0]]
        } else {
            [0.0; 2]
        }
    }
}

/// The cells of an object below which two walls continue: up to the corner where they cross, or
/// from one to the other where they lie on one line.
fn between(window: &Window, a: &Wall, b: &Wall) -> Vec<Buried> {
    let width_m = 0.5 * (a.width_m + b.width_m);
    let turn = (a.along[0] * b.along[1] - a.along[1] * b.along[0]).abs();
    if turn > TURN {
        let Some(corner) = crossing(a, b).filter(|p| is_core(window, *p)) else {
            return Vec::new();
        };
        let to = |wall: &Wall| below(window, wall, wall.up_to(corner, 0.5 * width_m));
        return [to(a), to(b)].concat();
    }
    let places = a.places.iter().chain(&b.places).copied().collect();
    let top_m = 0.5 * (a.top_m + b.top_m);
    let Some(whole) = Wall::through(places, top_m, window.grid.cell_m) else { return Vec::new() };
    if whole.width_m > a.width_m.max(b.width_m) + window.grid.cell_m {
        return Vec::new();
    }
    below(window, &whole, whole.ends)
}

/// The cells of an object that cover a stretch of a wall, given in m along it.
fn below(window: &Window, wall: &Wall, [from, to]: [f64; 2]) -> Vec<Buried> {
    let cell_m = window.grid.cell_m;
    let least_m = wall.top_m - LOWER * cell_m;
    let is_below = |&cell: &usize| {
        let p = window.grid.center(cell);
        let is_inside = wall.off(p) < 0.5 * wall.width_m && (from..to).contains(&wall.at(p));
        is_inside && window.zones[cell] == Zone::Core && window.heights_m[cell] > least_m
    };
    let buried = |cell: usize| Buried {
        cell,
        top_m: wall.top_m.min(window.heights_m[cell]),
        u_share: SIDES * cell_m / wall.width_m,
    };
    (0..window.zones.len()).filter(is_below).map(buried).collect()
}

fn is_core(window: &Window, p: [f64; 2]) -> bool {
    window.grid.holds(&[p[0], p[1], 0.0]) && window.zones[window.grid.cell(&p)] == Zone::Core
}

/// The crossing of the lines along two walls.
fn crossing(a: &Wall, b: &Wall) -> Option<[f64; 2]> {
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let along = cross(less(b.middle, a.middle), b.along) / cross(a.along, b.along);
    along.is_finite().then(|| [0, 1].map(|k| a.middle[k] + along * a.along[k]))
}

fn less(p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    [p[0] - q[0], p[1] - q[1]]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::face::tests::pile;
    use super::super::tests::{CELL, exact, window_of};
    use super::*;
    use crate::Point;

    const STEP: f64 = CELL / 3.0;
    const TOP: f64 = 0.45;

    fn cone(x: f64, y: f64) -> f64 {
        (0.5 * (1.2 - (x - 4.0).hypot(y - 3.0))).max(0.0)
    }

    /// Whether a place lies on a wall, 0.4 m wide, across the floor.
    fn is_wall(x: f64) -> bool {
        (4.0..4.4).contains(&x)
    }

    fn height(x: f64, y: f64) -> f64 {
        if is_wall(x) { cone(x, y).max(TOP) } else { cone(x, y) }
    }

    #[test]
    fn a_wall_below_a_pile_is_no_part_of_it() {
        let at = |i: i32| (f64::from(i) + 0.5) * STEP;
        let point =
            |i: i32| -> Point { [at(i % 384), at(i / 384), height(at(i % 384), at(i / 384))] };
        let face = |i: i32| -> Point {
            let x = if i % 2 == 0 { 4.0 } else { 4.4 };
            [x, at(i / 2 % 288), 0.025 * f64::from(i / 576)]
        };
        let faces = (0..576 * 18).map(face).filter(|p| p[2] > cone(p[0], p[1]));
        let points: Vec<Point> = (0..384 * 288).map(point).chain(faces).collect();
        let fine = |i: i32, from: f64| from + 0.01 * (f64::from(i) + 0.5);
        let material =
            |x: f64, y: f64| if is_wall(x) { (cone(x, y) - TOP).max(0.0) } else { cone(x, y) };
        let truth: f64 =
            (0..240 * 240).map(|i| 1e-4 * material(fine(i % 240, 2.8), fine(i / 240, 1.8))).sum();
        let off = pile(&points).volume.net_m3() - truth;
        let body = |x: f64, y: f64| if is_wall(x) { cone(x, y).min(TOP) } else { 0.0 };
        let body: f64 =
            (0..240 * 240).map(|i| 1e-4 * body(fine(i % 240, 2.8), fine(i / 240, 1.8))).sum();
        assert!(off.abs() < 0.2 * body, "{off} of {truth}, {body} of them wall");
    }

    /// A square block from 3 to 5 m along x and 2 to 4 m along y, of this height, amid a floor.
    fn block(height_m: f64) -> Window {
        let is_block = |x: f64, y: f64| (x - 4.0).abs() < 1.0 && (y - 3.0).abs() < 1.0;
        window_of(&exact(|x, y| if is_block(x, y) { height_m } else { 0.0 }), is_block)
    }

    /// The block, with walls that run into it on two sides, so many cells wide and long.
    fn walled(wide: usize, long: usize) -> Window {
        let mut window = block(1.0);
        for cell in 0..window.zones.len() {
            let [x, y] = window.grid.center(cell);
            let (away, beside) = (((x - 4.0).abs() - 1.0) / CELL, (y - 3.0) / CELL);
            if (0.0..long as f64).contains(&away) && (0.0..wide as f64).contains(&beside) {
                Arc::make_mut(&mut window.wall_tops_m)[cell] = TOP;
            }
        }
        window
    }

    #[test]
    fn a_wall_that_comes_out_of_a_pile_again_goes_on_below_it() {
        let found = buried(&walled(4, 12));
        assert_eq!(
            found.iter().map(|b| b.cell).collect::<std::collections::BTreeSet<_>>().len(),
            128
        );
        // Two sides that run anywhere through a cell, of four cells.
        let u_share = (2.0_f64 / 12.0).sqrt() / 4.0;
        assert!(found.iter().all(|b| (b.u_share / u_share - 1.0).abs() < 0.01 && b.top_m == TOP));
    }

    #[test]
    fn of_a_wall_of_few_cells_nobody_knows_where_it_goes() {
        assert!(!buried(&walled(1, 12)).is_empty() && buried(&walled(1, 10)).is_empty());
        // What lies more than twelve cells away tells nothing: it is no longer than it is wide.
        assert!(buried(&walled(7, 30)).is_empty());
    }

    /// A piece of wall 0.6 m long and 0.25 m wide, turned by an angle, whose middle is this far from a
    /// place.
    fn piece(from: [f64; 2], away_m: f64, turn_rad: f64) -> Wall {
        let [x, y] = [turn_rad.cos(), turn_rad.sin()];
        let at = |i: i32| {
            let (s, t) = (away_m + 0.05 * f64::from(i % 13 - 6), 0.0625 * f64::from(i / 13 - 2));
            [from[0] + s * x - t * y, from[1] + s * y + t * x]
        };
        Wall::through((0..65).map(at).collect(), TOP, CELL).unwrap()
    }

    #[test]
    fn walls_go_on_straight_or_meet_below_the_pile_by_20_degrees() {
        let joined = |off_m: f64, turn_deg: f64| {
            let turned = piece([4.0, 3.0 + off_m], 1.4, turn_deg.to_radians());
            !between(&block(1.0), &piece([4.0, 3.0], -1.4, 0.0), &turned).is_empty()
        };
        // The lines along them meet outside of the block, or inside.
        assert!(joined(0.25, 12.0) && joined(0.0, 30.0) && !joined(0.9, 30.0));
    }

    #[test]
    fn half_of_a_straight_wall_holds_points() {
        let straight = |every: fn(i32) -> bool| {
            let cells = (0..40).filter(|i| every(*i)).map(|i| [CELL * f64::from(i), 0.0]);
            Wall::through(cells.collect(), TOP, CELL).unwrap().is_straight(CELL)
        };
        assert!(straight(|i| i % 5 < 3) && !straight(|i| i % 3 == 0));
    }

    #[test]
    fn a_wall_is_not_below_what_is_lower_by_half_a_cell() {
        let cells = |lower: f64| {
            let window = block(TOP - lower * CELL);
            let wall = piece([4.0, 3.0], -1.4, 0.0);
            below(&window, &wall, [-9.0, 9.0]).len()
        };
        assert!(cells(0.3) > 0 && cells(0.8) == 0);
    }
}
