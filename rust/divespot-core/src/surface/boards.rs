//! Boards, walls and rods whose tops the walk came up to where a pile is as high as they are.
//!
//! No bulk material rises more steeply than 60° on two opposite sides. A face that a loader cut rises
//! so on one side only.

use super::columns::Columns;
use super::walk::{Reach, SIGMAS};
use crate::cancel::Polled;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;
use crate::piles::EIGHT;

/// One direction of each pair of opposite sides.
const AXES: [(isize, isize); 4] = [(1, 0), (0, 1), (1, 1), (1, -1)];

/// Takes the walked cells away that rise too steeply on two opposite sides, and returns them.
pub(crate) fn without_boards(columns: &Columns, heights_m: &mut [f64], noise_m: f64) -> Vec<usize> {
    let grid = &columns.grid;
    let known = || heights_m.iter().copied().filter(|h| !h.is_nan());
    let relief_m =
        known().fold(f64::NEG_INFINITY, f64::max) - known().fold(f64::INFINITY, f64::min);
    let across = grid.columns.max(grid.rows) as f64;
    let farthest = (relief_m / NEVER_STEEPER / grid.cell_m).ceil().min(across) as isize;
    let relief = Relief {
        columns,
        grid,
        heights_m,
        noise_m,
        reach_m: Reach::of(grid.cell_m, noise_m).far_m,
        farthest,
    };
    let boards: Vec<usize> =
        relief.near_lips().polled().filter(|&cell| relief.is_board(cell)).collect();
    boards.iter().for_each(|&cell| heights_m[cell] = f64::NAN);
    boards
}

struct Relief<'a> {
    columns: &'a Columns,
    grid: &'a Grid,
    heights_m: &'a [f64],
    noise_m: f64,
    reach_m: f64,
    /// Cells over which material could rise by all of the scene's relief.
    farthest: isize,
}

impl Relief<'_> {
    /// Whether a cell lies higher than material could above the one so many steps away.
    fn drops(&self, cell: usize, (dx, dy): (isize, isize), steps: isize) -> Option<bool> {
        let n = self.grid.neighbor(cell, steps * dx, steps * dy)?;
        let run = self.grid.cell_m * steps as f64 * (dx as f64).hypot(dy as f64);
        let drop = self.heights_m[cell] - self.heights_m[n];
        Some(drop > NEVER_STEEPER * run + SIGMAS * self.noise_m)
    }

    /// Cells near enough to the lip of a face that its drop could be too steep for them.
    fn near_lips(&self) -> impl Iterator<Item = usize> + '_ {
        let lip = |cell: usize| EIGHT.iter().any(|&way| self.drops(cell, way, 1) == Some(true));
        let mut near = vec![false; self.grid.len()];
        for cell in (0..near.len()).polled().filter(|&cell| lip(cell)) {
            self.grid.around(cell, self.farthest as usize).for_each(|n| near[n] = true);
        }
        (0..near.len()).filter(move |&cell| near[cell])
    }

    fn is_board(&self, cell: usize) -> bool {
        AXES.iter()
            .any(|&(dx, dy)| self.is_steep(cell, (dx, dy)) && self.is_steep(cell, (-dx, -dy)))
    }

    /// Whether the surface drops too steeply on one side, with nothing that rises before.
    fn is_steep(&self, cell: usize, (dx, dy): (isize, isize)) -> bool {
        for steps in 1..=self.farthest {
            if self.is_barred(cell, steps * dx, steps * dy) {
                return false;
            }
            if self.drops(cell, (dx, dy), steps) == Some(true) {
                return true;
            }
        }
        false
    }

    /// Whether something over a cell is higher than another.
    fn is_barred(&self, cell: usize, dx: isize, dy: isize) -> bool {
        let higher = |n| {
            self.columns.heights(n).last().is_some_and(|&z| z > self.heights_m[cell] + self.reach_m)
        };
        self.grid.neighbor(cell, dx, dy).is_some_and(higher)
    }
}
