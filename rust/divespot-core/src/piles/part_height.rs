//! Mean height above the base of the counted part of a cell, in m.

use super::window::Window;
use crate::material::NEVER_STEEPER;

/// Mean height above the base of the counted part of a cell, in m.
///
/// The slope between the neighbours carries the height from the cell's middle to the part's
/// centroid.
pub(crate) fn part_height(window: &Window, filled: &[f64], cell: usize) -> f64 {
    let part = window.counted(cell);
    let rise = |k: usize| {
        if part.off_m[k] == 0.0 { 0.0 } else { part.off_m[k] * slope(window, filled, cell, k) }
    };
    filled[cell] + rise(0) + rise(1)
}

fn slope(window: &Window, heights: &[f64], cell: usize, k: usize) -> f64 {
    let next = |step: isize| {
        let (dx, dy) = if k == 0 { (step, 0) } else { (0, step) };
        window.grid.neighbor(cell, dx, dy).map(|n| heights[n]).filter(|h| !h.is_nan())
    };
    let slope = match (next(-1), next(1)) {
        (Some(a), Some(b)) => (b - a) / (2.0 * window.grid.cell_m),
        (Some(a), None) => (heights[cell] - a) / window.grid.cell_m,
        (None, Some(b)) => (b - heights[cell]) / window.grid.cell_m,
        (None, None) => 0.0,
    };
    if slope.abs() <= NEVER_STEEPER { slope } else { 0.0 }
}
