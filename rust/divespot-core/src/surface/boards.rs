//! Boards, walls and rods whose tops the walk came up to where a pile is as high as they are.
//!
//! No bulk material rises more steeply than 60° on two opposite sides. A face that a loader cut rises
//! so on one side only. Nobody sees what lies behind a board that hides it: a top that is level up to
//! there, and from which a face drops at once, is a board's too. Where a pile is flush with it, its
//! top goes on as level and as thick as beside the pile.

use std::collections::VecDeque;

use super::columns::Columns;
use super::walk::{Reach, SIGMAS};
use crate::cancel::Polled;
use crate::connectivity::components;
use crate::connectivity::{AXES, EIGHT};
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::NEVER_STEEPER;
use crate::robust::median;

/// Fewer cells tell of no board one side of which was not seen.
const FEWEST: usize = 5;
/// A wall's face drops by this share of all that it drops within two cells of its lip.
const AT_ONCE: f64 = 0.8;
/// So many cells beyond the lip of a face it is at its foot.
const FOOT: isize = 4;
/// A cell is the top of a face and not its foot if it lies higher on average than this share of it.
const ON_TOP: f64 = 0.5;
/// In front of what is a board for sure there is a row of cells through which its face runs.
const FRONT: f64 = 1.5;
/// No more cells of a wall's face than these hold points at all heights.
const MIXED: isize = 2;

/// Takes the walked cells that are boards away, and returns them; what is `ground` beyond doubt is none
/// where one side of it was not seen.
pub(crate) fn without_boards(
    columns: &Columns,
    heights_m: &mut [f64],
    ground: &[bool],
    noise_m: f64,
) -> Vec<usize> {
    let boards = Relief::of(columns, heights_m, ground, noise_m).boards();
    boards.iter().for_each(|&cell| heights_m[cell] = f64::NAN);
    boards
}

struct Relief<'a> {
    columns: &'a Columns,
    grid: &'a Grid,
    heights_m: &'a [f64],
    ground: &'a [bool],
    /// The lowest points that lie below a walked height without a gap: in a face, those at its foot.
    lowest_m: Vec<f64>,
    /// The highest above it.
    highest_m: Vec<f64>,
    noise_m: f64,
    /// What two cells of a level top differ by.
    level_m: f64,
    /// Cells over which material could rise by all of the scene's relief.
    farthest: isize,
}

/// What a surface comes to on one side of a cell, and so many steps away.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    /// It goes on, or something rises.
    Open,
    /// It drops too steeply.
    Steep(isize),
    /// Nothing was seen of it any more.
    Unseen(isize),
}

impl<'a> Relief<'a> {
    fn of(columns: &'a Columns, heights_m: &'a [f64], ground: &'a [bool], noise_m: f64) -> Self {
        let grid = &columns.grid;
        let known = || heights_m.iter().copied().filter(|h| !h.is_nan());
        let relief_m =
            known().fold(f64::NEG_INFINITY, f64::max) - known().fold(f64::INFINITY, f64::min);
        let across = grid.columns.max(grid.rows) as f64;
        let farthest = (relief_m / NEVER_STEEPER / grid.cell_m).ceil().min(across) as isize;
        let reach = Reach::of(grid.cell_m, noise_m);
        let gap_m = 0.5 * reach.far_m;
        let run = |cell: usize| <(f64, f64)>::from(columns.run(cell, heights_m[cell], gap_m));
        let (lowest_m, highest_m) = (0..grid.len()).map(run).unzip();
        Self {
            columns,
            grid,
            heights_m,
            ground,
            lowest_m,
            highest_m,
            noise_m,
            level_m: reach.near_m,
            farthest,
        }
    }

    /// The cells of boards: those that are for sure, and what goes on as they do.
    fn boards(&self) -> Vec<usize> {
        let thick_m: Vec<f64> = self.thicknesses();
        let sure: Vec<bool> = thick_m.iter().map(|t| !t.is_nan()).collect();
        let mut is_board = sure.clone();
        for board in components(self.grid, sure, &EIGHT) {
            if board.len() < FEWEST {
                board.iter().for_each(|&cell| is_board[cell] = self.stands(cell));
                continue;
            }
            let thick_m = median(board.iter().map(|&cell| thick_m[cell]).collect());
            self.go_on(board, thick_m, &mut is_board);
        }
        (0..is_board.len()).filter(|&cell| is_board[cell]).collect()
    }

    /// How thick a board is in each cell that is one for sure; NaN elsewhere.
    fn thicknesses(&self) -> Vec<f64> {
        let mut thick_m = vec![f64::NAN; self.grid.len()];
        for cell in self.near_lips().polled() {
            let across = AXES.iter().filter_map(|&axis| self.across(cell, axis));
            thick_m[cell] = across.fold(f64::NAN, f64::min);
        }
        thick_m
    }

    /// Whether faces drop on two opposite sides of a cell.
    fn stands(&self, cell: usize) -> bool {
        let steep = |way| matches!(self.side(cell, way), Side::Steep(_));
        AXES.iter().any(|&(dx, dy)| steep((dx, dy)) && steep((-dx, -dy)))
    }

    /// How thick a board is across a cell along an axis, if it is one.
    fn across(&self, cell: usize, (dx, dy): (isize, isize)) -> Option<f64> {
        let at_once = |way, steps| !self.ground[cell] && self.drops_at_once(cell, way, steps);
        let steps = match (self.side(cell, (dx, dy)), self.side(cell, (-dx, -dy))) {
            (Side::Steep(a), Side::Steep(b)) => a + b,
            (Side::Steep(a), Side::Unseen(b)) if at_once((dx, dy), a) => a + b,
            (Side::Unseen(a), Side::Steep(b)) if at_once((-dx, -dy), b) => a + b,
            _ => return None,
        };
        Some(self.run_m((dx, dy), steps - 1))
    }

    /// Takes what is level with a board and no farther from its other side than it is thick.
    fn go_on(&self, board: Vec<usize>, thick_m: f64, is_board: &mut [bool]) {
        let mut front = VecDeque::from(board);
        while let Some(cell) = front.pop_front() {
            for n in self.grid.around(cell, 1) {
                if !is_board[n]
                    && !self.ground[n]
                    && self.is_level(cell, n)
                    && self.ends(n, thick_m)
                {
                    is_board[n] = true;
                    front.push_back(n);
                }
            }
        }
    }

    fn is_level(&self, a: usize, b: usize) -> bool {
        (self.heights_m[a] - self.heights_m[b]).abs() <= self.level_m
    }

    /// Whether a level top ends within a length in some direction: in a face, or unseen.
    fn ends(&self, cell: usize, within_m: f64) -> bool {
        let near = |way, steps| self.run_m(way, steps) <= within_m + FRONT * self.grid.cell_m;
        EIGHT.iter().any(|&way| match self.side(cell, way) {
            Side::Steep(steps) => near(way, steps) && self.drops_at_once(cell, way, steps),
            Side::Unseen(steps) => near(way, steps),
            Side::Open => false,
        })
    }

    /// Whether the cells before one so many steps away are level with this one.
    fn is_level_for(&self, cell: usize, (dx, dy): (isize, isize), steps: isize) -> bool {
        (1..steps - 1).all(|k| match self.grid.neighbor(cell, k * dx, k * dy) {
            Some(n) => self.heights_m[n].is_nan() || self.is_level(cell, n),
            None => true,
        })
    }

    fn run_m(&self, (dx, dy): (isize, isize), steps: isize) -> f64 {
        self.grid.cell_m * steps as f64 * (dx as f64).hypotenuse(dy as f64)
    }

    /// Whether a cell lies higher than material could above the one so many steps away.
    fn drops(&self, cell: usize, (dx, dy): (isize, isize), steps: isize) -> Option<bool> {
        let n = self.grid.neighbor(cell, steps * dx, steps * dy)?;
        Some(self.drops_to(cell, n, (dx, dy), steps))
    }

    fn drops_to(&self, cell: usize, n: usize, way: (isize, isize), steps: isize) -> bool {
        let drop = self.highest_m[cell] - self.lowest_m[n];
        let on_top = self.heights_m[cell] - self.lowest_m[n] > ON_TOP * drop;
        let run_m = || self.run_m(way, steps);
        on_top && drop > NEVER_STEEPER * run_m() + 2.0 * SIGMAS * self.noise_m
    }

    /// Whether a face drops at once by most of what it drops.
    fn drops_at_once(&self, cell: usize, (dx, dy): (isize, isize), steps: isize) -> bool {
        let drop = |k: isize| {
            let n = self.grid.neighbor(cell, k * dx, k * dy);
            n.map_or(f64::NAN, |n| self.highest_m[cell] - self.lowest_m[n])
        };
        let most = (steps..=steps + FOOT).map(drop).fold(0.0, f64::max);
        let known = |k: isize| k == 0 || !drop(k).is_nan();
        drop(steps).max(drop(steps + 1)) > AT_ONCE * most
            && ((steps - 1 - MIXED).max(0)..steps).any(known)
            && self.is_level_for(cell, (dx, dy), steps)
    }

    /// Cells near enough to the lip of a face that its drop could be too steep for them.
    fn near_lips(&self) -> impl Iterator<Item = usize> + '_ {
        let lip = |cell: usize| {
            let way = self.grid.ways(cell);
            let drops = |(dx, dy), k| {
                way((k * dx, k * dy)).is_some_and(|n| self.drops_to(cell, n, (dx, dy), k))
            };
            !self.heights_m[cell].is_nan() && EIGHT.iter().any(|&by| (1..=2).any(|k| drops(by, k)))
        };
        let mut near = vec![false; self.grid.len()];
        for cell in (0..near.len()).polled().filter(|&cell| lip(cell)) {
            self.grid.around(cell, self.farthest as usize).for_each(|n| near[n] = true);
        }
        (0..near.len()).filter(move |&cell| near[cell] && !self.heights_m[cell].is_nan())
    }

    /// What the surface comes to on one side, before anything rises there.
    fn side(&self, cell: usize, (dx, dy): (isize, isize)) -> Side {
        let mut unseen = None;
        for steps in 1..=self.farthest {
            let n = self.grid.neighbor(cell, steps * dx, steps * dy);
            if n.is_none_or(|n| self.columns.heights(n).is_empty()) {
                unseen = unseen.or(Some(steps));
                continue;
            }
            if n.is_some_and(|n| self.is_barred(cell, n)) {
                return Side::Open;
            }
            if self.drops(cell, (dx, dy), steps) == Some(true) {
                return Side::Steep(unseen.unwrap_or(steps));
            }
            if n.is_some_and(|n| !self.heights_m[n].is_nan()) {
                unseen = None;
            }
        }
        let level = |&steps: &isize| self.is_level_for(cell, (dx, dy), steps + 1);
        unseen.filter(level).map_or(Side::Open, Side::Unseen)
    }

    /// Whether something over a cell is higher than another by more than noise.
    fn is_barred(&self, cell: usize, other: usize) -> bool {
        let top = self.columns.heights(other).last();
        top.is_some_and(|&z| z > self.highest_m[cell] + SIGMAS * self.noise_m)
    }
}
