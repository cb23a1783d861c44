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

#[cfg(test)]
mod tests {
    use super::super::coverage::Coverage;
    use super::super::tests::{CELL, exact, window_of};
    use super::*;

    #[test]
    fn a_part_stands_as_the_slope_lets_expect_up_to_two_in_one() {
        let rise = |slope: f64| {
            let mut window =
                window_of(&exact(|x, _| slope * x), |x, y| (x - 4.0).hypot(y - 3.0) < 1.0);
            let cell = window.grid.cell(&[4.0, 3.0]);
            window
                .count_part(cell, Coverage { share: 0.5, off_m: [0.25 * CELL, 0.0], u_share: 0.0 });
            part_height(&window, &window.heights_m, cell) - window.heights_m[cell]
        };
        assert!((rise(1.5) - 1.5 * 0.25 * CELL).abs() < 1e-12 && rise(2.8) == 0.0);
    }
}
