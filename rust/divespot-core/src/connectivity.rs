//! Connected components of a grid's cells.

use crate::cancel::{Polled, poll};
use crate::heightmap::Grid;

/// The connected cells among those that are `left`, by their first cell; `ways` lead from a cell to
/// its neighbours.
pub(crate) fn components(grid: &Grid, left: Vec<bool>, ways: &[(isize, isize)]) -> Vec<Vec<usize>> {
    components_joined(grid, left, ways, |_, _| true)
}

/// The same, where a cell and its neighbour are connected only if they are `joined`.
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
