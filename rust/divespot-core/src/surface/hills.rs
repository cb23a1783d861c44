//! Tells hills from terrain by uphill paths (a merge tree of the heights, as in a watershed);
//! heights in m.
//!
//! From every cell a path leads uphill. From a heap it ends at a summit of its own, from a bank on
//! higher ground. Ground is every large gentle part of the surface, at any height, that is not a
//! top (`levels`). Holes are the hills of the surface turned upside down.

use crate::cancel::Polled;
use crate::connectivity::{EIGHT, FOUR, UNLABELLED};
use crate::count::to_f64;
use crate::error::Result;
use crate::extent::off_scan_cells;
use crate::harmonic::{Node, relax};
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::{NEVER_STEEPER, STEEPEST_POURED};
use crate::order::sort_by;
use crate::parallel::map_each;
use crate::slopes::Slopes;
use crate::terrain::{Terrain, terrain_of};
use crate::thread_count;

use super::levels::{Levels, NONE};

/// Least prominence of a summit above its saddle: this many standard deviations of a cell's noise
/// or this share of a cell's width, whichever is more. Chosen on the scenes of `divespot evaluate`.
const SIGMAS: f64 = 8.0;
const CELLS: f64 = 0.25;
/// The slope of a face is measured over this many cells. Chosen: over fewer, the noise of a cell is
/// a slope; over more, low faces run into their feet.
const FACE: usize = 3;

/// The hills on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Hills {
    /// Label of the hill in each cell, sorted by size; -1 for none.
    pub labels: Vec<i32>,
    /// Whether a cell is ground.
    pub ground: Vec<bool>,
    /// The ground surface, also below the hills.
    pub terrain: Terrain,
}

/// Finds the hills of a surface, given by its height in each cell, in m; NaN is unseen.
///
/// # Errors
///
/// A number of heights that is not the number of cells.
///
/// # Examples
///
/// ```
/// use divespot_core::heightmap::height_map;
/// use divespot_core::surface::hills;
///
/// // A cone 0.2 m high and 0.8 m wide on a floor, a point each 2 cm.
/// let cone = |x: f64, y: f64| (0.2 - 0.5 * (x - 1.0).hypot(y - 1.0)).max(0.0);
/// let places = (0..10_000).map(|i| [f64::from(i % 100) * 0.02, f64::from(i / 100) * 0.02]);
/// let points: Vec<_> = places.map(|[x, y]| [x, y, cone(x, y)]).collect();
/// let map = height_map(&points, 0.04)?;
/// let found = hills(&map.grid, &map.heights_m)?;
/// assert_eq!(found.labels.iter().max(), Some(&0), "one hill");
/// assert!(found.ground.iter().filter(|&&ground| ground).count() > 1500);
/// # Ok::<(), divespot_core::Error>(())
/// ```
pub fn hills(grid: &Grid, heights_m: &[f64]) -> Result<Hills> {
    grid.require_each("heights", heights_m.len())?;
    let (labels, ground, reach) = labelled(grid, heights_m);
    Ok(Hills { labels, terrain: terrain_of(grid, heights_m, &ground, reach), ground })
}

/// The labels of the hills, the cells of the ground, and the half-width of the window in which
/// their slope was measured.
fn labelled(grid: &Grid, heights_m: &[f64]) -> (Vec<i32>, Vec<bool>, usize) {
    let off_scan = off_scan_cells(grid, heights_m);
    let slopes = Slopes::of(grid, heights_m);
    let levels = Levels::of(grid, heights_m, &slopes, &off_scan);
    let filled = with_gaps_filled(grid, heights_m, &off_scan);
    let smooth = smoothed(grid, &filled);
    let order = downhill(&smooth, &off_scan);
    let relief = Relief { grid, heights_m: &filled, smooth_m: &smooth, noise_m: slopes.noise_m };
    let prominence_m = (SIGMAS * slopes.noise_m).max(CELLS * grid.cell_m);
    let largest = levels.largest();
    let mut is_ground: Vec<bool> =
        levels.edges.iter().map(|edge| edge.is_ground(largest)).collect();
    loop {
        let ground: Vec<bool> =
            levels.of.iter().map(|&part| part != NONE && is_ground[part as usize]).collect();
        let tree = PathTree::grown(&relief, &order, &ground, prominence_m);
        let joined = banks(&levels, &tree, &is_ground);
        if joined.is_empty() {
            return (components(grid, &tree), ground, slopes.reach);
        }
        joined.into_iter().for_each(|part| is_ground[part] = true);
    }
}

/// Finds the hills of a surface, and its holes: the hills of the same surface upside down.
///
/// `threads` = 0 takes every core that the process may use.
///
/// # Errors
///
/// As [`hills`].
pub fn hills_and_holes(grid: &Grid, heights_m: &[f64], threads: usize) -> Result<Vec<Hills>> {
    let below: Vec<f64> = heights_m.iter().map(|h| -h).collect();
    let ways = [heights_m, &below];
    map_each(&ways, thread_count(threads), |heights_m| hills(grid, heights_m)).into_iter().collect()
}

/// The heights, with unseen cells between seen ones interpolated harmonically.
fn with_gaps_filled(grid: &Grid, heights_m: &[f64], off_scan: &[bool]) -> Vec<f64> {
    let mut filled = heights_m.to_vec();
    let gaps: Vec<usize> =
        (0..grid.len()).filter(|&cell| heights_m[cell].is_nan() && !off_scan[cell]).collect();
    let known = || heights_m.iter().filter(|h| !h.is_nan());
    let (sum, count) = known().fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
    gaps.iter().for_each(|&cell| filled[cell] = sum / f64::max(count, 1.0));
    let largest = known().fold(0.0_f64, |most, h| most.max(h.abs()));
    let nodes: Vec<Node> = gaps.into_iter().map(Node::free).collect();
    relax(&mut filled, grid.columns, &nodes, largest);
    filled
}

/// The mean of each cell and its neighbours, except those across a cliff.
fn smoothed(grid: &Grid, heights_m: &[f64]) -> Vec<f64> {
    let most = NEVER_STEEPER * grid.cell_m;
    let mean = |cell: usize| {
        let here = heights_m[cell];
        let near = grid.around(cell, 1).map(|n| heights_m[n]).filter(|h| (h - here).abs() <= most);
        let (sum, count) = near.fold((0.0, 0.0), |(sum, count), h| (sum + h, count + 1.0));
        sum / count
    };
    (0..grid.len()).polled().map(mean).collect()
}

/// The cells from the highest down.
fn downhill(heights_m: &[f64], off_scan: &[bool]) -> Vec<u32> {
    let cells = (0..).zip(heights_m).zip(off_scan);
    let seen = cells.filter(|((_, h), off_scan)| !**off_scan && !h.is_nan());
    let cells = seen.map(|((cell, _), _)| cell).collect();
    sort_by(cells, |&cell: &u32| !ascending(heights_m[cell as usize]))
}

/// An integer that sorts as `f64::total_cmp` does.
fn ascending(value: f64) -> u64 {
    let bits = value.to_bits();
    if value.is_sign_negative() { !bits } else { bits | 1 << 63 }
}

/// The parts, not yet ground, from which most paths lead up to ground.
fn banks(levels: &Levels, tree: &PathTree, is_ground: &[bool]) -> Vec<usize> {
    let mut above = vec![(0_usize, 0_usize); is_ground.len()];
    for (cell, &part) in levels.of.iter().enumerate().polled() {
        if part == NONE || is_ground[part as usize] || levels.edges[part as usize].is_top() {
            continue;
        }
        let (bank, hill) = &mut above[part as usize];
        match tree.root(cell) {
            Some(GROUND) => *bank += 1,
            Some(_) => *hill += 1,
            None => {}
        }
    }
    (0..above.len()).filter(|&part| above[part].0 > above[part].1).collect()
}

/// The root of all ground.
const GROUND: u32 = 0;
/// Marks a cell without a node.
const NOTHING: u32 = u32::MAX;

/// The merge tree of the heights: each cell joins its highest neighbour.
struct PathTree {
    /// The node of each cell.
    of: Vec<u32>,
    /// The node that each node was joined to.
    joined: Vec<u32>,
    summit_m: Vec<f64>,
}

/// The heights over which paths lead.
struct Relief<'a> {
    grid: &'a Grid,
    heights_m: &'a [f64],
    smooth_m: &'a [f64],
    noise_m: f64,
}

/// The nodes around a cell, and the one its uphill path leads to.
struct Around {
    near: [u32; 9],
    count: usize,
    uphill: u32,
}

impl Around {
    fn add(&mut self, node: u32) {
        if !self.near[..self.count].contains(&node) {
            (self.near[self.count], self.count) = (node, self.count + 1);
        }
    }
}

impl Relief<'_> {
    /// Whether the step from one cell up to its neighbour is steeper than material stands.
    fn cliff(&self, from: usize, to: usize) -> bool {
        let rise = self.heights_m[to] - self.heights_m[from];
        if rise <= SIGMAS * self.noise_m {
            return false; // nearly everywhere, and much sooner known
        }
        let ([x, y], [u, v]) = (self.grid.center(from), self.grid.center(to));
        rise > NEVER_STEEPER * (u - x).hypotenuse(v - y) + SIGMAS * self.noise_m
    }

    /// Whether a bank's face ends at a cell at the scan's edge: the drop is steeper than poured
    /// material.
    fn leads_out(&self, cell: usize) -> bool {
        let is_out = |n: usize| self.smooth_m[n].is_nan();
        if !self.grid.is_border(cell) && !self.grid.around(cell, 1).any(is_out) {
            return false;
        }
        let drop_m = |n: usize| self.smooth_m[cell] - self.smooth_m[n];
        let run = FACE.cast_signed();
        let down = FOUR.iter().filter_map(|(dx, dy)| self.grid.neighbor(cell, run * dx, run * dy));
        let run_m = to_f64(FACE) * self.grid.cell_m;
        down.map(drop_m).any(|drop_m| drop_m > STEEPEST_POURED * run_m)
    }

    /// The uphill path leads to the highest cell around. Up a cliff it leads only from within a
    /// face, where there is a cliff downhill too: a slope that ends at the foot of a wall has its
    /// summit there.
    fn around(&self, tree: &PathTree, cell: usize) -> Around {
        let mut around = Around { near: [NOTHING; 9], count: 0, uphill: NOTHING };
        let (mut walked, mut climbed) =
            ((f64::NEG_INFINITY, NOTHING), (f64::NEG_INFINITY, NOTHING));
        let mut on_face = false;
        for n in self.grid.neighbors(cell, &EIGHT) {
            on_face |= self.cliff(n, cell);
            let Some(root) = tree.root(n) else { continue };
            let is_cliff = self.cliff(cell, n);
            let best = if is_cliff { &mut climbed } else { &mut walked };
            if self.smooth_m[n] > best.0 {
                *best = (self.smooth_m[n], root);
            }
            if !is_cliff {
                around.add(root);
            }
        }
        around.uphill = if on_face && climbed.1 != NOTHING { climbed.1 } else { walked.1 };
        around
    }
}

impl PathTree {
    fn grown(relief: &Relief<'_>, order: &[u32], ground: &[bool], prominence_m: f64) -> Self {
        let mut tree = Self {
            of: vec![NOTHING; ground.len()],
            joined: vec![GROUND],
            summit_m: vec![f64::INFINITY],
        };
        for &cell in order.iter().polled() {
            let cell = cell as usize;
            let mut around = relief.around(&tree, cell);
            tree.of[cell] = match (ground[cell], around.uphill) {
                (true, _) => GROUND,
                (false, NOTHING) if relief.leads_out(cell) => GROUND,
                (false, NOTHING) => tree.summit(relief.smooth_m[cell]),
                (false, node) => node,
            };
            around.add(tree.find(tree.of[cell]));
            tree.join(&around.near[..around.count], relief.smooth_m[cell], prominence_m);
        }
        tree
    }

    fn find(&self, mut node: u32) -> u32 {
        while self.joined[node as usize] != node {
            node = self.joined[node as usize];
        }
        node
    }

    fn root(&self, cell: usize) -> Option<u32> {
        match self.of[cell] {
            NOTHING => None,
            node => Some(self.find(node)),
        }
    }

    fn summit(&mut self, height_m: f64) -> u32 {
        let node = self.joined.len() as u32;
        self.joined.push(node);
        self.summit_m.push(height_m);
        node
    }

    /// Joins summits of little prominence to the highest one around.
    fn join(&mut self, near: &[u32], saddle_m: f64, least_m: f64) {
        let higher = |&a: &u32, &b: &u32| {
            self.summit_m[a as usize].total_cmp(&self.summit_m[b as usize]).then(b.cmp(&a))
        };
        let Some(highest) = near.iter().copied().max_by(higher) else { return };
        for &node in near {
            if node != highest && self.summit_m[node as usize] - saddle_m < least_m {
                self.joined[node as usize] = highest;
            }
        }
    }
}

/// Connected components of hill cells, numbered by size.
fn components(grid: &Grid, tree: &PathTree) -> Vec<i32> {
    let hill = |cell: usize| match tree.root(cell) {
        Some(GROUND) | None => UNLABELLED,
        Some(_) => 0,
    };
    let labels: Vec<i32> = (0..grid.len()).polled().map(hill).collect();
    crate::components::label_components(grid, &labels, 0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::mix;

    const CELL: f64 = 0.02;
    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: CELL, columns: 120, rows: 90 };

    /// A map with roughly normal noise: the sum of four uniform numbers.
    fn map(height: impl Fn(f64, f64) -> f64, noise_m: f64) -> Vec<f64> {
        let unit = |k: u64| (mix(k) >> 11) as f64 / (1_u64 << 53) as f64;
        let noise = |cell: u64| {
            let sum: f64 = (0..4).map(|k| unit(4 * cell + k)).sum();
            (sum - 2.0) * 3.0_f64.sqrt() * noise_m
        };
        let at = |cell: usize| {
            let [x, y] = GRID.center(cell);
            height(x, y) + noise(cell as u64)
        };
        (0..GRID.len()).map(at).collect()
    }

    fn found(height: impl Fn(f64, f64) -> f64) -> Hills {
        hills(&GRID, &map(height, 0.0005)).unwrap()
    }

    fn cone_at(x: f64, y: f64, [u, v]: [f64; 2], height_m: f64) -> f64 {
        (height_m - 0.45 * (x - u).hypot(y - v)).max(0.0)
    }

    fn cone(x: f64, y: f64) -> f64 {
        cone_at(x, y, [1.2, 0.9], 0.225)
    }

    /// Asserts that the labelled hills are the cells in which `on_it` is high enough above the
    /// floor.
    fn only_stands(floor: impl Fn(f64, f64) -> f64, on_it: impl Fn(f64, f64) -> f64) {
        let hills = found(|x, y| floor(x, y) + on_it(x, y));
        for (cell, &label) in hills.labels.iter().enumerate() {
            let [x, y] = GRID.center(cell);
            let stands = on_it(x, y);
            let beside =
                GRID.around(cell, 3).any(|n| on_it(GRID.center(n)[0], GRID.center(n)[1]) > 0.0);
            assert!(label == UNLABELLED || beside, "{x} {y}: {stands} is no hill");
            assert!(label != UNLABELLED || stands < 0.05, "{x} {y}: {stands} is a hill");
            assert!(!hills.ground[cell] || stands < 0.05, "{x} {y}: {stands} is no ground");
        }
        assert!(hills.terrain.noise_m < 0.002, "{}", hills.terrain.noise_m);
    }

    #[test]
    fn a_cone_stands_on_ground_of_any_gentle_form() {
        only_stands(|_, _| 0.5, cone);
        only_stands(|x, y| 0.05 * x - 0.03 * y, cone);
        only_stands(|x, y| 0.006 * (3.0 * x).sin() * (2.5 * y).cos(), cone);
        only_stands(|x, _| 0.052 * (x - 1.1).max(0.0), cone);
        only_stands(|x, _| -0.052 * (x - 1.1).max(0.0), cone);
    }

    #[test]
    fn a_step_across_the_scan_is_ground_on_both_sides() {
        only_stands(|x, _| if x > 1.9 { 0.03 } else { 0.0 }, cone);
        only_stands(|x, _| if x > 1.3 { 0.03 } else { 0.0 }, cone);
    }

    #[test]
    fn a_face_that_leads_out_of_the_scan_is_no_hill() {
        let face = |slope: f64| move |x: f64, _: f64| slope * (x - 2.0).max(0.0);
        let labels = |slope: f64| found(|x, y| face(slope)(x, y) + cone(x, y)).labels;
        let on_face = |labels: &[i32]| {
            let cells = (0..GRID.len()).filter(|&cell| GRID.center(cell)[0] > 2.1);
            cells.filter(|&cell| labels[cell] != UNLABELLED).count()
        };
        assert_eq!(on_face(&labels(1.5)), 0);
        // As flat as this, it may be a heap that was cut off.
        assert!(on_face(&labels(1.0)) > 1000);
        assert_eq!(labels(1.5)[45 * GRID.columns + 60], 0);
    }

    #[test]
    fn a_plate_amid_the_floor_and_a_heap_with_a_flat_top_are_no_ground() {
        let inside = |x: f64, y: f64| (0.6..1.6).contains(&x) && (0.4..1.2).contains(&y);
        only_stands(|_, _| 0.0, move |x, y| if inside(x, y) { 0.06 } else { 0.0 });
        only_stands(|_, _| 0.0, |x, y| cone(x, y).min(0.12));
    }

    #[test]
    fn beneath_a_hill_the_terrain_goes_on() {
        let hills = found(|x, y| 0.05 * x + cone(x, y));
        for (cell, &surface) in hills.terrain.surface_m.iter().enumerate() {
            let [x, y] = GRID.center(cell);
            assert!((surface - 0.05 * x).abs() < 0.02 || cone(x, y) > 0.0, "{x} {y}: {surface}");
            assert!((surface - 0.05 * x).abs() < 0.03, "{x} {y}: {surface}");
        }
    }

    /// The number of hills, and the places of the labelled cells.
    fn places(hills: &Hills) -> (i32, Vec<([f64; 2], i32)>) {
        let count = hills.labels.iter().max().unwrap() + 1;
        let labelled = hills.labels.iter().enumerate().filter(|(_, n)| **n != UNLABELLED);
        (count, labelled.map(|(cell, &n)| (GRID.center(cell), n)).collect())
    }

    #[test]
    fn heaps_on_two_levels_are_hills_and_the_bank_between_is_none() {
        let low = |x: f64, y: f64| cone_at(x, y, [0.5, 0.9], 0.16);
        let high = |x: f64, y: f64| cone_at(x, y, [1.9, 0.8], 0.12);
        let bank = |x: f64| (0.6 * (x - 1.1)).clamp(0.0, 0.2);
        let (count, cells) = places(&found(|x, y| bank(x) + low(x, y) + high(x, y)));
        assert_eq!(count, 2);
        for ([x, y], label) in cells {
            let near = if label == 0 { [0.5, 0.9, 0.16] } else { [1.9, 0.8, 0.12] };
            let away = (x - near[0]).hypot(y - near[1]);
            assert!(away < near[2] / 0.45 + 3.0 * CELL, "{x} {y} {label}");
        }
    }

    #[test]
    fn a_pit_a_ditch_and_the_edge_of_a_platform_are_no_hills() {
        let none = |height: &dyn Fn(f64, f64) -> f64| {
            let (count, cells) = places(&found(height));
            assert_eq!(count, 0, "{:?}", cells.first());
        };
        none(&|x, y| -cone(x, y));
        none(&|x, _| -(0.16 - 0.8 * (x - 1.6).abs()).max(0.0));
        none(&|x, _| if x > 1.7 { -1.0 } else { 0.0 });
    }

    #[test]
    fn two_summits_over_a_saddle_are_one_hill() {
        let both =
            |x: f64, y: f64| cone_at(x, y, [0.9, 0.9], 0.2).max(cone_at(x, y, [1.4, 0.9], 0.18));
        assert_eq!(places(&found(both)).0, 1);
    }

    /// A bank of slope 1 in 2 with a round bump on it.
    fn bump(height_m: f64) -> impl Fn(f64, f64) -> f64 {
        let off = |x: f64, y: f64| (x - 1.2).hypot(y - 0.9) / (6.0 * CELL);
        move |x, y| 0.5 * (x - 0.3).clamp(0.0, 1.8) + height_m * (-0.5 * off(x, y).powi(2)).exp()
    }

    /// Height of the bump above its saddle to the bank, in m.
    fn prominence(height_m: f64) -> f64 {
        let smooth = smoothed(&GRID, &map(bump(height_m), 0.0));
        let uphill = &smooth[45 * GRID.columns..][50..80];
        let drop = |from: usize| {
            let after = uphill[from..].iter().copied().fold(f64::INFINITY, f64::min);
            uphill[from] - after
        };
        (0..uphill.len()).map(drop).fold(0.0, f64::max)
    }

    /// Whether a bump of this prominence is a hill.
    fn is_hill(prominence_m: f64, noise_m: f64) -> bool {
        let heights = (0..2000).map(|k| 0.0002 * f64::from(k));
        let height_m = heights.into_iter().find(|&h| prominence(h) >= prominence_m).unwrap();
        let found = hills(&GRID, &map(bump(height_m), noise_m)).unwrap();
        found.labels.iter().any(|&n| n != UNLABELLED)
    }

    #[test]
    fn a_summit_of_little_prominence_is_part_of_its_bank() {
        assert!(!is_hill(0.18 * CELL, 0.0) && is_hill(0.4 * CELL, 0.0));
        let noise_m = 0.2 * CELL;
        assert!(!is_hill(5.5 * noise_m, noise_m) && is_hill(12.0 * noise_m, noise_m));
    }

    #[test]
    fn a_height_for_each_cell_is_needed() {
        assert!(hills(&GRID, &[0.0; 3]).is_err());
        let unseen = hills(&GRID, &vec![f64::NAN; GRID.len()]).unwrap();
        assert!(unseen.labels.iter().all(|&n| n == UNLABELLED));
    }
}
