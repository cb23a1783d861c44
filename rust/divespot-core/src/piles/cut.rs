//! Cells at the edge of the scan: the share of each that was scanned.
//!
//! The edge comes from a clipped point cloud or the limit of the view. A cell counts by its number
//! of points over that of the whole cells around it; its standard uncertainty is that of a Poisson
//! count.

use super::coverage::Coverage;
use super::window::Window;
use crate::count::to_f64;

/// Whole cells are looked for within this many columns and rows. Chosen: fewer find none in a
/// corner, more take counts from where the scan is denser or thinner.
const NEAR: usize = 3;

/// Counts every cell at the scan's edge by its share of the points in whole cells around it;
/// `count` gives the points of the cell at a place.
pub(crate) fn count_what_was_seen(window: &mut Window, count: impl Fn([f64; 2]) -> u32) {
    let counts: Vec<f64> =
        (0..window.zones.len()).map(|cell| f64::from(count(window.grid.center(cell)))).collect();
    let ends =
        |cell: usize| window.border[cell] || window.around(cell, 1).any(|n| window.off_scan[n]);
    let walled = |cell: usize| window.around(cell, NEAR).any(|n| window.walls[n]);
    let whole: Vec<bool> =
        (0..counts.len()).map(|cell| !ends(cell) && !window.heights_m[cell].is_nan()).collect();
    let share = |cell: usize| {
        let near = window.around(cell, NEAR).filter(|&n| whole[n]).map(|n| counts[n]);
        let (sum, cells) = near.fold((0.0, 0.0), |(sum, cells), c| (sum + c, cells + 1.0));
        (sum > cells).then_some((cell, (counts[cell] * cells / sum).min(1.0), sum / cells))
    };
    let edge: Vec<(usize, f64, f64)> = window
        .held()
        .filter(|&cell| ends(cell) && !walled(cell) && !window.heights_m[cell].is_nan())
        .filter_map(share)
        .collect();
    // The counts are independent: over n cells their standard uncertainty falls with √n.
    let independent = to_f64(edge.len()).sqrt();
    for (cell, share, typical) in edge {
        let u_share = (share / typical).sqrt() / independent;
        window.count_part(cell, Coverage { share, u_share, off_m: [0.0; 2] });
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{CELL, exact, window_of};
    use super::*;

    #[test]
    fn a_cell_that_is_cut_counts_by_what_cells_three_columns_around_hold() {
        let mut window = window_of(&exact(|_, _| 1.0), |x, y| x < 1.0 && (y - 3.0).abs() < 1.0);
        let column = |[x, _]: [f64; 2]| (x / CELL) as usize;
        let count = |p: [f64; 2]| [5, 10, 10, 16].get(column(p)).copied().unwrap_or(40);
        count_what_was_seen(&mut window, count);
        let part = window.counted(window.grid.cell(&[0.5 * CELL, 3.0]));
        // 10, 10 and 16 on average; the cells at the edge are independent of each other.
        assert!((part.share - 5.0 / 12.0).abs() < 1e-9, "{part:?}");
        let cells = window.held().filter(|&c| column(window.grid.center(c)) == 0).count();
        let u_share = 5.0_f64.sqrt() / 12.0 / to_f64(cells).sqrt();
        assert!((part.u_share / u_share - 1.0).abs() < 1e-9, "{part:?}");
    }
}
