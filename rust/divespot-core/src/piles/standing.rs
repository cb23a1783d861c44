//! Walls, recognised by their points off the surface beside them.

use super::retaining::{Ends, ends_scan, is_lip, is_retaining};
use crate::Point;
use crate::cancel::Polled;
use crate::connectivity::EIGHT;
use crate::connectivity::components;
use crate::count::to_f64;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;

/// Fewest points of a face. Chosen: one more than a plane needs; lower takes chance points for
/// walls, higher loses walls seen by few scan lines.
pub(super) const FEWEST: usize = 4;
/// Gaps in a wall up to twice this many cells wide are closed, as unseen parts of it. Chosen on the
/// scenes of `divespot evaluate`.
pub(super) const GAP: usize = 2;
/// Share of a wall's cells from which it must rise without a gap; a hanging thing touches the
/// surface in a few at most. Chosen on the scenes of `divespot evaluate`.
const ALONG: f64 = 0.2;

/// The walls of a scene, by cell.
pub(crate) struct Walls {
    /// Whether a face rises.
    pub(crate) is: Vec<bool>,
    /// Whether the wall is as high as the surface before it, so that its face was not seen.
    pub(crate) flush: Vec<bool>,
    /// Whether only the wall's top was seen.
    pub(crate) tops: Vec<bool>,
    /// Height of the wall's top in cells without a surface, in m; NaN elsewhere.
    pub(crate) tops_m: Vec<f64>,
    /// Whether a wall stands in a cell without a surface.
    pub(crate) standing: Vec<bool>,
    /// Whether something is higher than a surface in the cell.
    pub(crate) mixed: Vec<bool>,
    /// Whether the cell holds a wall or a gap in one.
    pub(crate) cells: Vec<bool>,
    /// Whether the cell belongs to a retaining wall.
    pub(crate) retaining: Vec<bool>,
}

impl Walls {
    /// The walls beside a surface of these heights; `risen` are the points off it with their cells,
    /// sorted by cell and height.
    pub(super) fn of(
        grid: &Grid,
        heights_m: &[f64],
        risen: &[(usize, Point)],
        margin_m: f64,
    ) -> Self {
        let Risen { mixed, rises, ends_m } = Risen::of(grid, heights_m, risen, margin_m);
        let is_bare = |cell: usize| heights_m[cell].is_nan() && !ends_m[cell][0].is_nan();
        let mut standing = vec![false; grid.len()];
        let (mut retaining, mut cells) = (standing.clone(), standing.clone());
        let ends = Ends::of(grid, heights_m);
        for thing in things(grid, &rises, is_bare) {
            let risen = to_f64(thing.iter().filter(|&&cell| rises[cell]).count());
            let retains = is_retaining(grid, heights_m, &thing, margin_m)
                || ends_scan(grid, &ends, &thing, &rises);
            if !retains && risen <= ALONG * to_f64(thing.len()) {
                continue;
            }
            for cell in thing {
                standing[cell] = is_bare(cell);
                retaining[cell] = retains;
                cells[cell] = true;
            }
        }
        let reach_m = reach_m_of(grid, margin_m);
        let is_flush = |cell: usize| {
            let level =
                |n: usize| ends_m[cell].iter().all(|end| (end - heights_m[n]).abs() < reach_m);
            standing[cell] && !rises[cell] && grid.around(cell, 1).any(level)
        };
        let flush = each(grid, is_flush);
        let tops = each(grid, |c| retaining[c] && standing[c] && !rises[c] && !flush[c]);
        let top_m = |c: usize| if standing[c] { ends_m[c][1] } else { f64::NAN };
        let tops_m = (0..grid.len()).map(top_m).collect();
        let any = retaining.contains(&true);
        let lips = each(grid, |c| any && is_lip(grid, heights_m, &retaining, c, margin_m));
        for cell in (0..grid.len()).filter(|&cell| lips[cell]) {
            (standing[cell], retaining[cell]) = (true, true);
        }
        let is = each(grid, |c| rises[c] || flush[c] || retaining[c] && standing[c]);
        Self { is, flush, tops, tops_m, standing, mixed, cells, retaining }
    }

    /// Cells of walls and of the gaps in them: no flank or object continues across them.
    pub(super) fn bars(&self, grid: &Grid) -> Vec<bool> {
        barred(grid, &closed(grid, &each(grid, |cell| self.is[cell] || self.standing[cell])))
    }
}

/// The points off a surface, summarised by cell.
struct Risen {
    /// Whether something is higher than the surface.
    mixed: Vec<bool>,
    /// Whether it rises from the surface without a gap.
    rises: Vec<bool>,
    /// The lowest and the highest point, in m.
    ends_m: Vec<[f64; 2]>,
}

impl Risen {
    fn of(grid: &Grid, heights_m: &[f64], risen: &[(usize, Point)], margin_m: f64) -> Self {
        let clear_m = NEVER_STEEPER * grid.cell_m + margin_m;
        let reach_m = reach_m_of(grid, margin_m);
        let mut mixed = vec![false; grid.len()];
        let mut rises = mixed.clone();
        let mut ends_m = vec![[f64::NAN; 2]; grid.len()];
        for column in risen.chunk_by(|a, b| a.0 == b.0).polled() {
            let cell = column[0].0;
            let around = grid.around(cell, 1).map(|n| heights_m[n]).filter(|h| !h.is_nan());
            let surface_m = around.fold(f64::NEG_INFINITY, f64::max);
            let above = column.iter().map(|(_, p)| p[2] - surface_m).filter(|&z| z > 0.0);
            let (low, high) =
                above.fold((f64::INFINITY, 0.0_f64), |(low, high), z| (low.min(z), high.max(z)));
            mixed[cell] = high > clear_m;
            rises[cell] = mixed[cell] && column.len() >= FEWEST && low < reach_m;
            ends_m[cell] = [column[0].1[2], column[column.len() - 1].1[2]];
        }
        Self { mixed, rises, ends_m }
    }
}

/// Largest height of a face's lowest points above the surface that it rises from, in m.
fn reach_m_of(grid: &Grid, margin_m: f64) -> f64 {
    2.0 * (NEVER_STEEPER * grid.cell_m) + margin_m
}

fn each(grid: &Grid, is: impl Fn(usize) -> bool) -> Vec<bool> {
    (0..grid.len()).map(is).collect()
}

/// Morphological closing: the cells, and the gaps between them.
fn closed(grid: &Grid, cells: &[bool]) -> Vec<bool> {
    let mut wide = vec![false; cells.len()];
    for cell in (0..cells.len()).filter(|&cell| cells[cell]) {
        grid.around(cell, GAP).for_each(|n| wide[n] = true);
    }
    each(grid, |cell| wide[cell] && grid.around(cell, GAP).all(|n| wide[n]))
}

/// The cells, and those between two of them that touch at a corner, so that no path passes through
/// a wall diagonally.
fn barred(grid: &Grid, cells: &[bool]) -> Vec<bool> {
    let at =
        |cell: usize, dx: isize, dy: isize| grid.neighbor(cell, dx, dy).is_some_and(|n| cells[n]);
    let beside = |cell: usize, dx: isize, dy: isize| at(cell, dx, dy) || at(cell, -dx, -dy);
    let corner = |cell: usize| beside(cell, 1, 0) && beside(cell, 0, 1);
    let any = cells.contains(&true);
    each(grid, |cell| cells[cell] || any && corner(cell))
}

/// Connected components of cells at which a face rises or that hold loose points but no surface.
fn things(grid: &Grid, rises: &[bool], is_bare: impl Fn(usize) -> bool) -> Vec<Vec<usize>> {
    let cells = each(grid, |cell| rises[cell] || is_bare(cell));
    components(grid, closed(grid, &cells), &EIGHT)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: 1.0, columns: 40, rows: 20 };

    fn over(cell: usize, heights_m: &[f64]) -> Vec<(usize, Point)> {
        let [x, y] = GRID.center(cell);
        heights_m.iter().map(|&z| (cell, [x, y, z])).collect()
    }

    #[test]
    fn four_points_or_more_are_a_face() {
        let rises = |heights_m: &[f64]| {
            Risen::of(&GRID, &vec![0.0; GRID.len()], &over(210, heights_m), 0.0).rises[210]
        };
        assert!(rises(&[0.5, 1.0, 1.5, 2.0, 2.5]) && !rises(&[0.5, 1.5, 2.5]));
    }

    #[test]
    fn gaps_of_four_cells_in_a_wall_are_closed() {
        let is_closed = |next: usize| {
            let cells: Vec<bool> =
                (0..GRID.len()).map(|c| [10, next].contains(&(c % 40))).collect();
            closed(&GRID, &cells)[10 * 40 + 13]
        };
        assert!(is_closed(15) && !is_closed(16));
    }

    #[test]
    fn a_wall_rises_in_a_fifth_of_its_cells() {
        let stands = |rising: usize| {
            let strip: Vec<usize> = (0..20).map(|k| 10 * 40 + 10 + k).collect();
            let mut heights_m = vec![0.0; GRID.len()];
            strip.iter().for_each(|&cell| heights_m[cell] = f64::NAN);
            let column = |(k, &cell): (usize, &usize)| match k < rising {
                true => over(cell, &[0.5, 1.0, 1.5, 2.0, 2.5]),
                false => over(cell, &[30.0]),
            };
            let risen: Vec<(usize, Point)> = strip.iter().enumerate().flat_map(column).collect();
            Walls::of(&GRID, &heights_m, &risen, 0.0).standing[strip[10]]
        };
        assert!(stands(5) && !stands(3));
    }
}
