//! Walls: what stands beside the surface, told by the points off it.

use super::face::FEWEST;
use super::retaining::{is_lip, is_retaining};
use super::territory::EIGHT;
use crate::Point;
use crate::cancel::Polled;
use crate::connectivity::components;
use crate::count::to_f64;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;

/// Gaps in a wall up to twice so many cells wide are what was not seen of it.
pub(super) const GAP: usize = 2;
/// A wall rises from the surface in this share of its cells; what hangs over it touches it at most.
const ALONG: f64 = 0.2;

/// What stands in each cell.
pub(super) struct Walls {
    /// Whether a face rises.
    pub(super) is: Vec<bool>,
    /// Those that are as high as the surface before them: the face was not seen.
    pub(super) flush: Vec<bool>,
    /// Those of which only the top was seen.
    pub(super) tops: Vec<bool>,
    /// Whether a wall stands where there is no surface.
    pub(super) standing: Vec<bool>,
    /// Whether something is higher than a surface there.
    pub(super) mixed: Vec<bool>,
    /// Whether a wall is there, or a gap in it.
    pub(super) walls: Vec<bool>,
    /// Those of retaining walls.
    pub(super) retaining: Vec<bool>,
}

impl Walls {
    /// What stands beside a surface of these heights; `risen` are the points off it with their cells,
    /// in order of cell and height.
    pub(super) fn of(
        grid: &Grid,
        heights_m: &[f64],
        risen: &[(usize, Point)],
        margin_m: f64,
    ) -> Self {
        let step_m = NEVER_STEEPER * grid.cell_m;
        let (clear_m, reach_m) = (step_m + margin_m, 2.0 * step_m + margin_m);
        let mut is = vec![false; grid.len()];
        let mut mixed = is.clone();
        let mut ends_m = vec![[f64::NAN; 2]; grid.len()];
        for column in risen.chunk_by(|a, b| a.0 == b.0).polled() {
            let cell = column[0].0;
            let around = grid.around(cell, 1).map(|n| heights_m[n]).filter(|h| !h.is_nan());
            let surface_m = around.fold(f64::NEG_INFINITY, f64::max);
            let above = column.iter().map(|(_, p)| p[2] - surface_m).filter(|&z| z > 0.0);
            let (low, high) =
                above.fold((f64::INFINITY, 0.0_f64), |(low, high), z| (low.min(z), high.max(z)));
            mixed[cell] = high > clear_m;
            is[cell] = mixed[cell] && column.len() >= FEWEST && low < reach_m;
            ends_m[cell] = [column[0].1[2], column[column.len() - 1].1[2]];
        }
        let mut standing = vec![false; grid.len()];
        let (mut retaining, mut walls) = (standing.clone(), standing.clone());
        for thing in things(grid, heights_m, &is, &ends_m) {
            let rises = to_f64(thing.iter().filter(|&&cell| is[cell]).count());
            let retains = is_retaining(grid, heights_m, &thing, margin_m);
            if !retains && rises <= ALONG * to_f64(thing.len()) {
                continue;
            }
            for cell in thing {
                standing[cell] = is_bare(heights_m, &ends_m, cell);
                retaining[cell] = retains;
                walls[cell] = true;
            }
        }
        let is_flush = |cell: usize| {
            let level =
                |n: usize| ends_m[cell].iter().all(|end| (end - heights_m[n]).abs() < reach_m);
            standing[cell] && !is[cell] && grid.around(cell, 1).any(level)
        };
        let flush: Vec<bool> = (0..grid.len()).map(is_flush).collect();
        let is_top = |cell: usize| retaining[cell] && standing[cell] && !is[cell] && !flush[cell];
        let tops = (0..grid.len()).map(is_top).collect();
        let lip = |&cell: &usize| is_lip(grid, heights_m, &retaining, cell, margin_m);
        for cell in (0..grid.len()).filter(lip).collect::<Vec<_>>() {
            (standing[cell], retaining[cell]) = (true, true);
        }
        let is_wall = |cell: usize| is[cell] || flush[cell] || retaining[cell] && standing[cell];
        let is = (0..grid.len()).map(is_wall).collect();
        Self { is, flush, standing, tops, mixed, walls, retaining }
    }
}

/// The cells of walls, with the gaps between them closed: nothing goes on across them.
pub(super) fn bars(grid: &Grid, is: &[bool], standing: &[bool]) -> Vec<bool> {
    let walls: Vec<bool> = is.iter().zip(standing).map(|(a, b)| *a || *b).collect();
    barred(grid, &closed(grid, &walls))
}

/// The cells, and the gaps between them: those that lie far from whatever is far from them.
fn closed(grid: &Grid, cells: &[bool]) -> Vec<bool> {
    if !cells.contains(&true) {
        return cells.to_vec();
    }
    let near = |cell: usize| grid.around(cell, GAP).any(|n| cells[n]);
    let wide: Vec<bool> = (0..cells.len()).map(near).collect();
    (0..cells.len()).map(|cell| grid.around(cell, GAP).all(|n| wide[n])).collect()
}

/// The cells, and those between two of them across a corner: no step leads from corner to corner
/// through a wall.
fn barred(grid: &Grid, cells: &[bool]) -> Vec<bool> {
    let at =
        |cell: usize, dx: isize, dy: isize| grid.neighbor(cell, dx, dy).is_some_and(|n| cells[n]);
    let beside = |cell: usize, dx: isize, dy: isize| at(cell, dx, dy) || at(cell, -dx, -dy);
    let corner = |cell: usize| beside(cell, 1, 0) && beside(cell, 0, 1);
    (0..cells.len()).map(|cell| cells[cell] || corner(cell)).collect()
}

/// Cells without a surface that hold loose points, and those in which a face rises, joined.
fn things(grid: &Grid, heights_m: &[f64], is: &[bool], ends_m: &[[f64; 2]]) -> Vec<Vec<usize>> {
    let cells: Vec<bool> =
        (0..grid.len()).map(|cell| is[cell] || is_bare(heights_m, ends_m, cell)).collect();
    components(grid, closed(grid, &cells), &EIGHT)
}

fn is_bare(heights_m: &[f64], ends_m: &[[f64; 2]], cell: usize) -> bool {
    heights_m[cell].is_nan() && !ends_m[cell][0].is_nan()
}
