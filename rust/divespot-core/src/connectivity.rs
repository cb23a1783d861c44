//! Connected components of a grid's cells.

use crate::cancel::{Polled, poll};
use crate::heightmap::Grid;

/// The connected cells among those that are `left`, by their first cell; `ways` lead from a cell to
/// its neighbours.
pub(crate) fn components(
    grid: &Grid,
    mut left: Vec<bool>,
    ways: &[(isize, isize)],
) -> Vec<Vec<usize>> {
    let mut all = Vec::new();
    for first in (0..left.len()).polled() {
        if !std::mem::take(&mut left[first]) {
            continue;
        }
        let (mut cells, mut next) = (vec![first], 0);
        while let Some(&cell) = cells.get(next) {
            poll();
            for n in ways.iter().filter_map(|&(dx, dy)| grid.neighbor(cell, dx, dy)) {
                if std::mem::take(&mut left[n]) {
                    cells.push(n);
                }
            }
            next += 1;
        }
        all.push(cells);
    }
    all
}
