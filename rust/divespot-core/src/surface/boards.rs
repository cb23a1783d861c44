//! Removes boards, walls and rods from the walked surface: the walk reaches their tops where a pile
//! is as high as they are.
//!
//! No bulk material rises more steeply than 60° on two opposite sides; a face cut by a loader does
//! so on one side only. The far side of a board may be occluded. So a level top up to the occlusion
//! edge, from which a face drops within two cells, is a board's too. Where the pile is flush with a
//! board, the board continues level and with the same thickness. Lengths in m.

use std::collections::{BTreeMap, VecDeque};

use super::columns::Columns;
use super::walk::{Reach, SIGMAS};
use crate::cancel::Polled;
use crate::connectivity::components;
use crate::connectivity::{AXES, EIGHT};
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::NEVER_STEEPER;
use crate::robust::median;

/// Fewest cells of a board with an occluded side. Chosen: fewer may be the top of any shadowed
/// heap, more loses short boards.
const FEWEST: usize = 5;
/// Share of its whole drop by which a wall's face drops within two cells of its upper edge. Chosen
/// on the scenes of `divespot evaluate`.
const AT_ONCE: f64 = 0.8;
/// Distance from a face's upper edge to its foot, in cells. Chosen: nearer cells hold points of the
/// face, farther ones leave what is before it.
const FOOT: isize = 4;
/// A cell is the top of a face, not its foot, if its mean height is above this share of the face.
/// Chosen: half way up; lower takes feet for tops, higher loses tops with points of the face in
/// them.
const ON_TOP: f64 = 0.5;
/// Allowance for the cells before a board through which its face runs, in cells: one, and half a
/// one for where it runs. Chosen: less loses boards, more thickens walls.
const FRONT: f64 = 1.5;
/// Most cells of a wall's face, in a row across it, that hold points at all heights. Chosen: an
/// upright face touches two; more takes slopes for faces.
const MIXED: isize = 2;

/// Removes the walked cells that are boards, and returns them. `ground` cells with an occluded side
/// are kept.
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
    /// Lowest point below the walked height without a gap, in m: in a face, the point at its foot.
    lowest_m: Vec<f64>,
    /// Highest point above the walked height without a gap, in m: asked for in many directions.
    highest_m: Vec<f64>,
    noise_m: f64,
    /// Largest height difference of two neighbouring cells of a level top, in m.
    level_m: f64,
    /// Distance, in cells, over which material at its steepest rises by the scene's whole relief.
    farthest: isize,
}

/// How the surface ends on one side of a cell, and after how many steps.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    /// It continues, or something rises there.
    Open,
    /// It drops more steeply than material stands.
    Steep(isize),
    /// It is not seen any more.
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
        let lowest_m = |cell: usize| columns.lowest(cell, heights_m[cell], gap_m);
        let highest_m = |cell: usize| columns.highest(cell, heights_m[cell], gap_m);
        Self {
            columns,
            grid,
            heights_m,
            ground,
            lowest_m: (0..grid.len()).map(lowest_m).collect(),
            highest_m: (0..grid.len()).map(highest_m).collect(),
            noise_m,
            level_m: reach.near_m,
            farthest,
        }
    }

    /// The cells of boards: certain ones, and those that continue them.
    fn boards(&self) -> Vec<usize> {
        let thick_m = self.thicknesses();
        let mut sure = vec![false; self.grid.len()];
        thick_m.keys().for_each(|&cell| sure[cell] = true);
        let mut is_board = sure.clone();
        for board in components(self.grid, sure, &EIGHT) {
            if board.len() < FEWEST {
                board.iter().for_each(|&cell| is_board[cell] = self.stands(cell));
                continue;
            }
            let thick_m = median(board.iter().map(|cell| thick_m[cell]).collect());
            self.go_on(board, thick_m, &mut is_board);
        }
        (0..is_board.len()).filter(|&cell| is_board[cell]).collect()
    }

    /// Thickness of the board in each certain cell, in m; there are few.
    fn thicknesses(&self) -> BTreeMap<usize, f64> {
        let thick_m = |cell: usize| {
            let across = AXES.iter().filter_map(|&axis| self.across(cell, axis));
            Some((cell, across.reduce(f64::min)?))
        };
        self.near_lips().polled().filter_map(thick_m).collect()
    }

    /// Whether faces drop on two opposite sides of a cell.
    fn stands(&self, cell: usize) -> bool {
        let steep = |way| matches!(self.side(cell, way), Side::Steep(_));
        AXES.iter().any(|&(dx, dy)| steep((dx, dy)) && steep((-dx, -dy)))
    }

    /// Thickness of a board at a cell along an axis, in m; `None` if it is no board.
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

    /// Adds the cells that are level with a board and within its thickness of its far side.
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

    /// Whether a level top ends within this length in some direction, at a face or unseen.
    fn ends(&self, cell: usize, within_m: f64) -> bool {
        let near = |way, steps| self.run_m(way, steps) <= within_m + FRONT * self.grid.cell_m;
        EIGHT.iter().any(|&way| match self.side(cell, way) {
            Side::Steep(steps) => near(way, steps) && self.drops_at_once(cell, way, steps),
            Side::Unseen(steps) => near(way, steps),
            Side::Open => false,
        })
    }

    /// Whether the cells from this one up to `steps` away are level with it.
    fn is_level_for(&self, cell: usize, (dx, dy): (isize, isize), steps: isize) -> bool {
        (1..steps - 1).all(|k| match self.grid.neighbor(cell, k * dx, k * dy) {
            Some(n) => self.heights_m[n].is_nan() || self.is_level(cell, n),
            None => true,
        })
    }

    fn run_m(&self, (dx, dy): (isize, isize), steps: isize) -> f64 {
        self.grid.cell_m * steps as f64 * (dx as f64).hypotenuse(dy as f64)
    }

    /// Whether a cell is higher above the one `steps` away than material stands.
    fn drops(&self, cell: usize, (dx, dy): (isize, isize), steps: isize) -> Option<bool> {
        let n = self.grid.neighbor(cell, steps * dx, steps * dy)?;
        Some(self.drops_to(cell, n, self.most_m((dx, dy), steps)))
    }

    /// What material drops by, at most, so many steps away.
    fn most_m(&self, way: (isize, isize), steps: isize) -> f64 {
        NEVER_STEEPER * self.run_m(way, steps) + 2.0 * SIGMAS * self.noise_m
    }

    fn drops_to(&self, cell: usize, n: usize, most_m: f64) -> bool {
        let drop = self.highest_m[cell] - self.lowest_m[n];
        drop > most_m && self.heights_m[cell] - self.lowest_m[n] > ON_TOP * drop
    }

    /// Whether a face makes most of its drop within two cells.
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

    /// Cells so near to the upper edge of a face that its drop could be too steep for them.
    fn near_lips(&self) -> impl Iterator<Item = usize> + '_ {
        let step =
            |&by: &(isize, isize)| [1, 2].map(|k| ((k * by.0, k * by.1), self.most_m(by, k)));
        let steps: Vec<((isize, isize), f64)> = EIGHT.iter().flat_map(step).collect();
        let lip = |cell: usize| {
            let way = self.grid.ways(cell);
            let drops = |&(by, most_m): &_| way(by).is_some_and(|n| self.drops_to(cell, n, most_m));
            !self.heights_m[cell].is_nan() && steps.iter().any(drops)
        };
        let mut near = vec![false; self.grid.len()];
        for cell in (0..near.len()).polled().filter(|&cell| lip(cell)) {
            self.grid.around(cell, self.farthest as usize).for_each(|n| near[n] = true);
        }
        (0..near.len()).filter(move |&cell| near[cell] && !self.heights_m[cell].is_nan())
    }

    /// How the surface ends on one side, up to where something rises.
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

    /// Whether something over a cell is higher than another cell by more than noise.
    fn is_barred(&self, cell: usize, other: usize) -> bool {
        let top = self.columns.heights(other).last();
        top.is_some_and(|&z| z > self.highest_m[cell] + SIGMAS * self.noise_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Point;

    /// A surface of so many rows, as high as each column is.
    fn surface(rows: usize, heights_m: &[f64]) -> Columns {
        let columns = heights_m.len();
        let grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns, rows };
        let point = |cell: usize| -> Point {
            let [x, y] = grid.center(cell);
            [x, y, heights_m[cell % columns]]
        };
        Columns::of(&(0..grid.len()).map(point).collect::<Vec<_>>(), grid, 1)
    }

    /// What a test asks of the relief of a surface, its own heights walked.
    fn ask<T>(rows: usize, heights_m: &[f64], question: impl Fn(&Relief<'_>) -> T) -> T {
        let columns = surface(rows, heights_m);
        let walked: Vec<f64> = (0..columns.grid.len()).map(|c| columns.heights(c)[0]).collect();
        let ground = vec![false; walked.len()];
        question(&Relief::of(&columns, &walked, &ground, 0.0))
    }

    #[test]
    fn a_cell_higher_than_half_of_a_drop_is_on_top_of_it() {
        let is_on_top = |height_m: f64| {
            let columns = surface(1, &[height_m, 0.0]);
            let (walked, ground) = ([height_m, 0.0], [false; 2]);
            let relief = Relief::of(&columns, &walked, &ground, 0.0);
            let relief = Relief { highest_m: vec![10.0, 0.0], ..relief };
            relief.drops_to(0, 1, relief.most_m((1, 0), 1))
        };
        assert!(is_on_top(6.5) && !is_on_top(3.5));
    }

    #[test]
    fn a_face_drops_at_once_by_four_fifths_of_what_it_drops_over_four_cells() {
        let at_once = |drops_m: [f64; 9]| {
            let heights_m: Vec<f64> = [10.0].into_iter().chain(drops_m.map(|d| 10.0 - d)).collect();
            ask(1, &heights_m, |relief| relief.drops_at_once(0, (1, 0), 1))
        };
        let foot = |first_m: f64, at: usize| {
            let mut drops_m = [first_m; 9];
            drops_m[at - 1..].fill(10.0);
            drops_m
        };
        assert!(at_once(foot(9.0, 5)) && !at_once(foot(6.5, 5)));
        assert!(at_once(foot(6.5, 8)), "farther away is another face");
    }

    #[test]
    fn in_front_of_a_board_there_is_a_cell_and_a_half_of_its_face() {
        let ends = |away: usize| {
            let heights_m: Vec<f64> = (0..24).map(|x| if x < 12 { 10.0 } else { 0.0 }).collect();
            ask(21, &heights_m, |relief| relief.ends(10 * 24 + 12 - away, 1.0))
        };
        assert!(ends(2) && !ends(3));
    }

    #[test]
    fn no_more_than_two_cells_of_a_face_hold_points_at_all_heights() {
        let at_once = |mixed: usize| {
            let height = |x: usize| {
                if x == 0 {
                    10.0
                } else if x <= mixed {
                    5.0
                } else {
                    0.0
                }
            };
            let columns = surface(1, &(0..9).map(height).collect::<Vec<_>>());
            let walked: Vec<f64> = (0..9)
                .map(|x| if (1..=mixed).contains(&x) { f64::NAN } else { height(x) })
                .collect();
            let ground = [false; 9];
            Relief::of(&columns, &walked, &ground, 0.0).drops_at_once(0, (1, 0), mixed as isize + 1)
        };
        assert!(at_once(2) && !at_once(3));
    }
}
