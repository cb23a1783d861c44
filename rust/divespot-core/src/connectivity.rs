//! Connected components of a grid's cells, and flood fills.

use crate::cancel::{Polled, poll};
use crate::heightmap::Grid;

/// The label of cells that belong to no object.
pub(crate) const UNLABELLED: i32 = -1;

/// Columns and rows to the neighbours across the edges of a cell.
pub(crate) const FOUR: [(isize, isize); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];
/// One of each pair of opposite directions.
pub(crate) const AXES: [(isize, isize); 4] = [(1, 0), (0, 1), (1, 1), (1, -1)];
/// Columns and rows to the neighbours across edges and corners.
pub(crate) const EIGHT: [(isize, isize); 8] =
    [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)];

/// The connected components of the cells that are `left`, sorted by their first cell; `ways` lead
/// from a cell to its neighbours.
pub(crate) fn components(grid: &Grid, left: Vec<bool>, ways: &[(isize, isize)]) -> Vec<Vec<usize>> {
    components_joined(grid, left, ways, |_, _| true)
}

/// The same, where two neighbours are connected only if `joined` holds for them.
pub(crate) fn components_joined(
    grid: &Grid,
    mut left: Vec<bool>,
    ways: &[(isize, isize)],
    joined: impl Fn(usize, usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut all = Vec::new();
    for first in (0..left.len()).polled() {
        if !std::mem::take(&mut left[first]) {
            continue;
        }
        let (mut cells, mut next) = (vec![first], 0);
        while let Some(&cell) = cells.get(next) {
            poll();
            for n in grid.neighbors(cell, ways) {
                if left[n] && joined(cell, n) {
                    left[n] = false;
                    cells.push(n);
                }
            }
            next += 1;
        }
        all.push(cells);
    }
    all
}

/// The cells reachable from the grid's border through `passable` cells.
pub(crate) fn flood(grid: &Grid, passable: impl Fn(usize) -> bool) -> Vec<bool> {
    let border = (0..grid.len()).filter(|&c| grid.is_border(c) && passable(c)).collect();
    spread(grid, border, passable)
}

/// The cells reachable from `seeds` through `passable` cells, including `seeds`.
pub(crate) fn spread(
    grid: &Grid,
    seeds: Vec<usize>,
    passable: impl Fn(usize) -> bool,
) -> Vec<bool> {
    let mut reached = vec![false; grid.len()];
    let mut stack = seeds;
    stack.iter().for_each(|&cell| reached[cell] = true);
    while let Some(cell) = stack.pop() {
        poll();
        for (dx, dy) in FOUR {
            let Some(n) = grid.neighbor(cell, dx, dy) else { continue };
            if !reached[n] && passable(n) {
                reached[n] = true;
                stack.push(n);
            }
        }
    }
    reached
}
