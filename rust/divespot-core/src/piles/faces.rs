//! Finds the faces in a scene: cells where points rise more steeply than 60°, which no bulk
//! material does.

use super::found::Found;
use super::standing::{GAP, Walls};
use crate::Point;
use crate::connectivity::UNLABELLED;
use crate::extent;
use crate::heightmap::Grid;
use crate::material::NEVER_STEEPER;

/// Largest distance of a face from the last cell with only the pile's points, in cells. Chosen: one
/// or two hold points of both; less leaves a gap to the wall, more takes the next wall's points.
pub(super) const BEYOND: usize = 3;
/// Cells of a square with the half-width [`GAP`].
const WIDE: usize = (2 * GAP + 1) * (2 * GAP + 1);

/// The faces of a scene.
pub(crate) struct Faces {
    /// The wall in each cell, banks included.
    pub(crate) walls: Walls,
    /// Cells of walls and of the gaps in them: no flank or object continues across them.
    pub(crate) bars: Vec<bool>,
    /// The points that may lie on a face, sorted by cell and height.
    risen: Vec<(usize, Point)>,
}

impl Faces {
    /// Finds where loose points, or a bank beside an object, rise more than `margin_m` above what
    /// the steepest material could reach within a cell.
    pub(crate) fn of(grid: &Grid, heights_m: &[f64], found: &Found, margin_m: f64) -> Self {
        let mut risen = by_cell(grid, found.loose.iter(), |_| true);
        let mut walls = Walls::of(grid, heights_m, &risen, margin_m);
        let step_m = NEVER_STEEPER * grid.cell_m;
        let rises =
            |cell: usize, from: usize| heights_m[cell] - heights_m[from] > step_m + margin_m;
        let banks: Vec<usize> = (0..grid.len())
            .filter(|&cell| found.is_bank(cell))
            .filter(|&c| {
                let at_face = grid.around(c, GAP).any(|n| walls.is[n]);
                let beside = |n: usize| found.labels[n] != UNLABELLED && (at_face || rises(c, n));
                grid.around(c, 1).any(beside)
            })
            .collect();
        if !banks.is_empty() {
            let mut near = vec![false; grid.len()];
            banks.iter().flat_map(|&c| grid.around(c, BEYOND)).for_each(|n| near[n] = true);
            banks.iter().for_each(|&c| (walls.is[c], walls.retaining[c]) = (true, true));
            risen.extend(by_cell(grid, found.surface.iter(), |cell| near[cell]));
            risen.sort_unstable_by(by_place);
        }
        let bars = walls.bars(grid);
        Self { walls, bars, risen }
    }

    /// The cells outside the convex hull of the seen surface. An occluded gap between the surface
    /// and a wall is not the end of the scan; an unseen part of a wall's top is.
    pub(crate) fn off_scan(&self, grid: &Grid, heights_m: &[f64]) -> Vec<bool> {
        let known = |(&h, &stands): (&f64, &bool)| if h.is_nan() && stands { 0.0 } else { h };
        let all: Vec<f64> = heights_m.iter().zip(&self.walls.standing).map(known).collect();
        let outside = extent::off_scan_cells(grid, &all);
        if !self.walls.standing.contains(&true) {
            return outside;
        }
        let unseen = |cell: usize| all[cell].is_nan() && !outside[cell] && !self.bars[cell];
        let wide = |cell: usize| grid.around(cell, GAP).filter(|&n| unseen(n)).count() == WIDE;
        let wide: Vec<bool> = (0..grid.len()).map(wide).collect();
        let surface = extent::off_scan_cells(grid, heights_m);
        let is_beyond = |cell: usize| {
            outside[cell] || surface[cell] && !grid.around(cell, GAP).any(|n| wide[n])
        };
        (0..grid.len()).map(is_beyond).collect()
    }

    /// The points off the surface over a cell.
    pub(super) fn over(&self, cell: usize) -> impl Iterator<Item = &Point> {
        let first = self.risen.partition_point(|(c, _)| *c < cell);
        self.risen[first..].iter().take_while(move |(c, _)| *c == cell).map(|(_, p)| p)
    }
}

/// The points over the wanted cells, sorted by cell and height.
fn by_cell<'a>(
    grid: &Grid,
    points: impl Iterator<Item = &'a Point>,
    wanted: impl Fn(usize) -> bool,
) -> Vec<(usize, Point)> {
    let on_map = points.filter(|p| grid.holds(p)).map(|p| (grid.cell(p), *p));
    let mut found: Vec<(usize, Point)> = on_map.filter(|&(cell, _)| wanted(cell)).collect();
    found.sort_unstable_by(by_place);
    found
}

fn by_place((m, p): &(usize, Point), (n, q): &(usize, Point)) -> std::cmp::Ordering {
    let place = p[2].total_cmp(&q[2]).then(p[0].total_cmp(&q[0])).then(p[1].total_cmp(&q[1]));
    m.cmp(n).then(place)
}
