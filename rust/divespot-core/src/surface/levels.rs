//! Levels: the large gentle parts of a surface, at any height, and which of them are ground or
//! tops.
//!
//! Method: connected components of cells that slope by less than 7.5°, classified by where the
//! surface goes at their edge. Sizes in cells, heights in m.

use std::iter::successors;

use crate::cancel::{Polled, poll};
use crate::connectivity::components;
use crate::connectivity::{EIGHT, FOUR};
use crate::count::to_f64;
use crate::heightmap::Grid;
use crate::material::{GENTLE, NEVER_STEEPER};
use crate::slopes::Slopes;

/// Least size of a level: this many cells, and this share of the largest part. Chosen on the scenes
/// of `divespot evaluate`.
const FEWEST: usize = 40;
const SHARE: f64 = 0.02;
/// In a scan of few cells, this share of the seen cells is enough. Chosen: lower makes levels of a
/// few cells on a pile, higher leaves small scans without ground.
const MUCH: f64 = 0.1;
/// Shares of a level's edge: most of it (a top goes down there), and some of it. Chosen on the
/// scenes of `divespot evaluate`.
const MOST: f64 = 0.75;
const SOME: f64 = 0.25;

/// Height differences within this many standard deviations of the noise are no step. Chosen: of
/// normal errors 1 in 16,000 is beyond; lower finds steps in noise, higher joins low steps.
const CLEAR: f64 = 4.0;

/// A part is about as large as the largest from this share of its size. Chosen: half; lower makes
/// ground of tops, higher loses the second of two yards.
const LARGE: f64 = 0.5;

/// The top of a wall is smaller than this share of the largest part. Chosen on the scenes of
/// `divespot evaluate`.
const LID: f64 = 0.2;

/// Marks a cell that lies in no part.
pub(crate) const NONE: u32 = u32::MAX;

/// The large gentle parts of a height map.
pub(crate) struct Levels {
    /// The number of the part of each cell.
    pub(crate) of: Vec<u32>,
    pub(crate) edges: Vec<Edge>,
}

/// The surroundings of a part's edge, as numbers of cells.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Edge {
    pub(crate) cells: usize,
    up: f64,
    even: f64,
    down: f64,
    /// Cells of `down` reached by a drop steeper than material stands.
    cliff: f64,
    /// Unseen cells beyond the scan's edge.
    open: f64,
}

impl Edge {
    fn all(&self) -> f64 {
        (self.up + self.even + self.down + self.open).max(1.0)
    }

    /// Whether the part is the top of a thing on the ground: it has cliffs along its edge, where
    /// the scan does not end, and nothing rises from it.
    pub(crate) fn is_lid(&self, largest: usize) -> bool {
        let small = to_f64(self.cells) < LID * to_f64(largest);
        let cliffs = self.cliff / self.all();
        self.up < 0.1 * self.all() && (cliffs > 0.5 || small && cliffs > SOME)
    }

    /// Whether the part is certainly a top.
    pub(crate) fn is_top(&self) -> bool {
        self.down > MOST * self.all()
    }

    /// Whether the part is certainly ground: little of its edge goes down, or the scan ends there,
    /// or it is a plate with cliffs around it on which something stands, or it is about as large as
    /// the largest part and no top.
    pub(crate) fn is_ground(&self, largest: usize) -> bool {
        let large = to_f64(self.cells) > LARGE * to_f64(largest) && !self.is_top();
        let some = SOME * self.all();
        self.down < some || self.open > some || self.is_plate() || large
    }

    /// Whether the part has cliffs along its edge and something stands on it.
    fn is_plate(&self) -> bool {
        self.cliff > SOME * self.all() && self.up > 0.1 * self.all()
    }
}

impl Levels {
    /// The levels of a height map; `off_scan` are the cells outside the scan.
    pub(crate) fn of(grid: &Grid, heights_m: &[f64], slopes: &Slopes, off_scan: &[bool]) -> Self {
        let gentle = slopes.gentle.iter().zip(heights_m).map(|(&gentle, h)| gentle && !h.is_nan());
        let parts = components(grid, gentle.collect(), &FOUR);
        let largest = parts.iter().map(Vec::len).max().unwrap_or(0);
        let seen = to_f64(heights_m.iter().filter(|h| !h.is_nan()).count());
        let fewest = FEWEST.min((MUCH * seen) as usize);
        let near_m = GENTLE * grid.cell_m + CLEAR * slopes.noise_m;
        let on_plane = |part: &[usize]| part.iter().all(|&cell| heights_m[cell].abs() <= near_m);
        let candidate = |part: &Vec<usize>| part.len() >= fewest || on_plane(part);
        let parts: Vec<Vec<usize>> = parts.into_iter().filter(candidate).collect();
        let Slopes { noise_m, reach, .. } = *slopes;
        let looker = Looker { grid, heights_m, off_scan, noise_m, reach };
        let of = numbered(grid, parts.iter());
        let mut stamps = vec![NONE; grid.len()];
        let edges =
            (0..).zip(&parts).map(|(part, cells)| looker.edge(part, cells, &of, &mut stamps));
        let least = SHARE * to_f64(largest);
        let is_level = |(part, edge): &(&Vec<usize>, Edge)| {
            to_f64(part.len()) >= least || edge.is_plate() || on_plane(part)
        };
        let (parts, edges): (Vec<_>, Vec<_>) = parts.iter().zip(edges).filter(is_level).unzip();
        let mut of = numbered(grid, parts.into_iter());
        looker.widen(&mut of);
        Self { of, edges }
    }

    /// The size of the largest part, in cells.
    pub(crate) fn largest(&self) -> usize {
        self.edges.iter().map(|edge| edge.cells).max().unwrap_or(0)
    }
}

/// The number of the part of each cell.
fn numbered<'a>(grid: &Grid, parts: impl Iterator<Item = &'a Vec<usize>>) -> Vec<u32> {
    let mut of = vec![NONE; grid.len()];
    for (part, cells) in (0..).zip(parts) {
        cells.iter().for_each(|&cell| of[cell] = part);
    }
    of
}

/// Looks at the surroundings of a part.
struct Looker<'a> {
    grid: &'a Grid,
    heights_m: &'a [f64],
    off_scan: &'a [bool],
    noise_m: f64,
    /// Half-width, in cells, of the window in which a cell's slope is measured; no cell nearer to
    /// an edge is gentle.
    reach: usize,
}

/// A step on a path outwards from a cell of a part.
#[derive(Clone, Copy)]
struct Step {
    from: usize,
    cell: usize,
    /// Its number along the path, and the index of the step before it.
    count: usize,
    before: usize,
}

impl Looker<'_> {
    /// Follows paths outwards from a part's cells and compares the heights there with the part's
    /// nearest cell.
    fn edge(&self, part: u32, cells: &[usize], of: &[u32], stamps: &mut [u32]) -> Edge {
        let mut edge = Edge { cells: cells.len(), ..Edge::default() };
        let steps = self.outwards(part, cells, of, stamps);
        // From the last step back: the whole path down a cliff counts as cliff.
        let mut cliffs = vec![false; steps.len()];
        for (at, step) in steps.iter().enumerate().rev().polled() {
            if step.count > self.reach {
                let is_cliff = cliffs[at] || self.is_cliff(&steps, step);
                self.look(&mut edge, step, is_cliff);
                cliffs[step.before] |= is_cliff;
            }
            if self.grid.is_border(step.cell) {
                edge.open += to_f64(self.farthest() - step.count.max(self.reach));
            }
        }
        edge
    }

    /// The number of the last step of a path.
    fn farthest(&self) -> usize {
        2 * self.reach + 3
    }

    /// The steps outwards from the cells at a part's edge.
    fn outwards(&self, part: u32, cells: &[usize], of: &[u32], stamps: &mut [u32]) -> Vec<Step> {
        let outer = |cell: &usize| {
            let way = self.grid.ways(*cell);
            FOUR.iter().any(|&by| way(by).is_none_or(|n| of[n] != part))
        };
        let first = |cell: usize| Step { from: cell, cell, count: 0, before: 0 };
        let mut steps: Vec<Step> = cells.iter().copied().filter(outer).map(first).collect();
        let mut at = 0;
        while let Some(&Step { from, cell, count, .. }) = steps.get(at) {
            poll();
            let around: &[(isize, isize)] = match count {
                last if last == self.farthest() => &[],
                even if even % 2 == 0 => &FOUR,
                _ => &EIGHT,
            };
            for n in self.grid.neighbors(cell, around) {
                if of[n] != part && stamps[n] != part {
                    stamps[n] = part;
                    steps.push(Step { from, cell: n, count: count + 1, before: at });
                }
            }
            at += 1;
        }
        steps
    }

    /// Adds to each part the cells around it, within the half-width of the window, to which it
    /// continues as gently: near the scan's edge and beside steep things no window is gentle.
    fn widen(&self, of: &mut [u32]) {
        let beside = |cell: usize| self.grid.neighbors(cell, &EIGHT).any(|n| of[n] == NONE);
        let parted = (0..of.len()).filter(|&cell| of[cell] != NONE && beside(cell));
        let mut front: Vec<(usize, usize)> = parted.map(|cell| (cell, cell)).collect();
        for step in 1..=self.reach {
            let most = GENTLE * to_f64(step) * self.grid.cell_m + CLEAR * self.noise_m;
            let mut next = Vec::new();
            for (from, cell) in front.into_iter().polled() {
                for n in self.grid.neighbors(cell, &EIGHT) {
                    let rise = (self.heights_m[n] - self.heights_m[from]).abs();
                    if of[n] == NONE && rise <= most {
                        of[n] = of[from];
                        next.push((from, n));
                    }
                }
            }
            front = next;
        }
    }

    /// Drop from the part to a step, in m.
    fn fall_m(&self, step: &Step) -> f64 {
        self.heights_m[step.from] - self.heights_m[step.cell]
    }

    /// Height difference from which a step is not level with the part, in m.
    fn clear_m(&self, step: &Step) -> f64 {
        CLEAR * self.noise_m + 0.1 * to_f64(step.count) * self.grid.cell_m
    }

    fn look(&self, edge: &mut Edge, step: &Step, cliff: bool) {
        let (fall_m, clear_m) = (self.fall_m(step), self.clear_m(step));
        if fall_m.is_nan() {
            edge.open += if self.off_scan[step.cell] { 1.0 } else { 0.0 };
        } else if -fall_m > clear_m {
            edge.up += 1.0;
        } else if fall_m > clear_m {
            edge.down += 1.0;
            edge.cliff += if cliff { 1.0 } else { 0.0 };
        } else {
            edge.even += 1.0;
        }
    }

    /// Whether a step lies at the foot of a cliff: the drop ends there, and its middle half is
    /// steeper than material stands, unseen cells included. A drop over one or two cells counts as
    /// a cliff, because one cell can hold both top and foot.
    fn is_cliff(&self, steps: &[Step], to: &Step) -> bool {
        let (fall_m, last_m) = (self.fall_m(to), self.fall_m(&steps[to.before]));
        let falls_on = fall_m - last_m > GENTLE * self.grid.cell_m + CLEAR * self.noise_m;
        let off_m = |step: &Step| (self.fall_m(step) - 0.5 * fall_m).abs();
        let amid = |step: &Step| off_m(step).is_nan() || off_m(step) < 0.25 * fall_m;
        let way = successors(Some(to), |step| (step.count > 0).then(|| &steps[step.before]));
        let run_m = (to_f64(way.filter(|step| amid(step)).count()) - 1.0) * self.grid.cell_m;
        !falls_on && fall_m > self.clear_m(to) && 0.5 * fall_m > NEVER_STEEPER * run_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid_of(columns: usize, rows: usize) -> Grid {
        Grid { origin_m: [0.0; 2], cell_m: 1.0, columns, rows }
    }

    fn levels_of(grid: &Grid, height: impl Fn(f64, f64) -> f64) -> Levels {
        let at = |cell: usize| height(grid.center(cell)[0], grid.center(cell)[1]);
        let heights: Vec<f64> = (0..grid.len()).map(at).collect();
        let slopes = Slopes::of(grid, &heights);
        Levels::of(grid, &heights, &slopes, &vec![false; grid.len()])
    }

    /// A plate `width` by `length` cells on a floor.
    fn plate(width: f64, length: f64, [x0, y0]: [f64; 2]) -> impl Fn(f64, f64) -> f64 {
        move |x, y| {
            let on = (x0..x0 + width).contains(&x) && (y0..y0 + length).contains(&y);
            if on { 9.0 } else { 0.0 }
        }
    }

    #[test]
    fn a_part_of_few_cells_is_no_level() {
        let count = |width, length| {
            levels_of(&grid_of(40, 40), plate(width, length, [10.0, 10.0])).edges.len()
        };
        // A cell at the edge of a plate is not gentle: the windows reach one cell beyond.
        assert_eq!((count(8.0, 12.0), count(7.0, 8.0)), (2, 1));
    }

    #[test]
    fn of_a_scan_of_few_cells_a_tenth_is_a_level() {
        let count = |side: usize, width| {
            levels_of(&grid_of(side, side), plate(width, width, [3.0, 3.0])).edges.len()
        };
        // 22 of 225 cells: a plate six cells wide has 16 gentle ones, one of seven has 25.
        assert_eq!((count(15, 6.0), count(15, 7.0)), (1, 2));
        // 40 of 576 cells.
        assert_eq!((count(24, 8.0), count(24, 9.0)), (1, 2));
    }

    #[test]
    fn nor_is_one_of_a_small_share_of_the_largest() {
        let count = |width, length| {
            levels_of(&grid_of(100, 100), plate(width, length, [10.0, 10.0])).edges.len()
        };
        assert_eq!((count(17.0, 20.0), count(12.0, 17.0)), (2, 1));
    }

    #[test]
    fn unless_it_lies_on_the_ground_plane() {
        let count = |floor_m: f64| {
            let flank = move |x: f64, y: f64| floor_m + 0.6 * (x.max(y) - 7.0).max(0.0);
            levels_of(&grid_of(40, 40), flank).edges.len()
        };
        assert_eq!((count(0.0), count(0.5)), (1, 0));
    }

    #[test]
    fn the_edge_of_a_plate_goes_down_a_cliff_and_that_of_a_floor_up() {
        let levels = levels_of(&grid_of(40, 40), plate(14.0, 14.0, [13.0, 13.0]));
        let (floor, plate) = (levels.edges[0], levels.edges[1]);
        assert!(floor.is_ground(400) && !floor.is_top() && !floor.is_lid(floor.cells), "{floor:?}");
        assert!(plate.is_top() && plate.is_lid(floor.cells) && !plate.is_ground(400), "{plate:?}");
        assert!(plate.cliff == plate.down && plate.up == 0.0 && plate.open == 0.0);
        // Near the cliff, where windows are cut, the levels are widened up to it.
        assert!(levels.of.iter().all(|&part| part != NONE));
    }

    #[test]
    fn a_cliff_is_one_where_its_foot_lies_in_a_shadow() {
        let shaded = |dark: f64, high: f64| {
            let height = move |x: f64, y: f64| {
                let off = (x - 20.0).abs().max((y - 20.0).abs()) - 8.0;
                let floor = if off < dark { f64::NAN } else { 0.0 };
                if off < 0.0 { high } else { floor }
            };
            let levels = levels_of(&grid_of(40, 40), height);
            let plate = levels.edges.iter().find(|edge| edge.cells < 400).copied().unwrap();
            (plate.cliff, plate.down)
        };
        let (cliff, down) = shaded(3.0, 17.0);
        assert!(down > 0.0 && cliff == down);
        // A bank may lie there.
        assert_eq!(shaded(3.0, 6.0).0, 0.0);
    }

    #[test]
    fn a_bank_is_neither_level_beside_it() {
        let bank = |x: f64, _: f64| (0.6 * (x - 15.0)).clamp(0.0, 6.0);
        let levels = levels_of(&grid_of(40, 20), bank);
        let [low, high] = levels.edges[..] else { panic!("{:?}", levels.edges) };
        assert!(low.down == 0.0 && low.up > 0.0 && high.up == 0.0 && high.down > 0.0);
        assert!(high.cliff == 0.0 && low.is_ground(400) && low.open > 0.0);
        assert_eq!((levels.of[20], levels.of[10], levels.of[30]), (NONE, 0, 1));
    }

    #[test]
    fn a_small_part_is_a_level_where_something_stands_on_its_cliffs() {
        let heap = |x: f64, y: f64| (6.0 - 0.6 * (x - 50.0).hypot(y - 50.0)).max(0.0);
        let slab = |x: f64, y: f64, rise: f64| {
            if (x - 50.0).abs().max((y - 50.0).abs()) < 16.0 { rise } else { 0.0 }
        };
        let count = |rise: f64, heap: &dyn Fn(f64, f64) -> f64| {
            let floor = grid_of(200, 200);
            levels_of(&floor, |x, y| slab(x, y, rise) + heap(x, y)).edges.len()
        };
        // 700 cells of the slab are seen; a fiftieth of the floor is 780.
        assert_eq!((count(1.5, &heap), count(9.0, &heap), count(0.0, &heap)), (2, 2, 1));
        let flank = |x: f64, y: f64| {
            let off = (x - 50.0).abs().max((y - 50.0).abs());
            (0.75 * (24.0 - off)).clamp(0.0, 6.0)
        };
        let lies = levels_of(&grid_of(200, 200), |x, y| flank(x, y) + heap(x, y));
        assert!(lies.edges.iter().all(|edge| edge.cliff == 0.0), "{:?}", lies.edges);
    }

    fn edge(down: f64, cliff: f64, up: f64) -> Edge {
        Edge { cells: 100, up, even: 1.0 - down - up, down, cliff, open: 0.0 }.times(100.0)
    }

    impl Edge {
        fn times(self, by: f64) -> Self {
            let Self { cells, up, even, down, cliff, open } = self;
            let [up, even, down, cliff, open] = [up, even, down, cliff, open].map(|v| by * v);
            Self { cells, up, even, down, cliff, open }
        }
    }

    #[test]
    fn shares_of_an_edge_tell_tops_and_ground() {
        assert!(edge(0.2, 0.0, 0.0).is_ground(400) && !edge(0.3, 0.0, 0.0).is_ground(400));
        assert!(edge(0.8, 0.0, 0.0).is_top() && !edge(0.7, 0.0, 0.0).is_top());
        let open = |open| Edge { open, ..edge(0.5, 0.0, 0.0) }.is_ground(400);
        assert!(open(40.0) && !open(20.0));
    }

    #[test]
    fn a_plate_with_cliffs_is_ground_where_something_stands_on_it() {
        assert!(edge(0.6, 0.3, 0.15).is_ground(400) && !edge(0.6, 0.2, 0.15).is_ground(400));
        assert!(!edge(0.6, 0.3, 0.07).is_ground(400));
    }

    #[test]
    fn a_part_nearly_as_large_as_the_largest_is_ground_unless_it_is_a_top() {
        let is_ground = |down, largest| edge(down, 0.0, 0.0).is_ground(largest);
        assert!(is_ground(0.5, 199) && !is_ground(0.5, 201) && !is_ground(0.8, 199));
    }

    #[test]
    fn a_lid_is_small_with_some_cliffs_or_has_many() {
        let lid = |cliff, up, largest| edge(0.8, cliff, up).is_lid(largest);
        assert!(lid(0.6, 0.0, 100) && !lid(0.4, 0.0, 100) && !lid(0.3, 0.0, 350));
        assert!(lid(0.3, 0.0, 700) && !lid(0.2, 0.0, 700));
        assert!(lid(0.6, 0.07, 100) && !lid(0.6, 0.15, 100));
    }

    #[test]
    fn a_step_within_the_noise_is_none() {
        let grid = grid_of(9, 1);
        let seen = |rise: f64| {
            let heights_m: Vec<f64> = (0..9).map(|x| if x < 5 { 0.0 } else { rise }).collect();
            let off_scan = [false; 9];
            let looker = Looker {
                grid: &grid,
                heights_m: &heights_m,
                off_scan: &off_scan,
                noise_m: 1.0,
                reach: 1,
            };
            let mut edge = Edge::default();
            looker.look(&mut edge, &Step { from: 4, cell: 5, count: 1, before: 0 }, false);
            [edge.up, edge.even, edge.down]
        };
        assert_eq!((seen(3.0), seen(-3.0)), ([0.0, 1.0, 0.0], [0.0, 1.0, 0.0]));
        assert_eq!((seen(5.5), seen(-5.5)), ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
    }
}
