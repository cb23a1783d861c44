//! The angle at which a pile stands, taken from its own flanks.

use crate::heightmap::Grid;
use crate::robust::{median, scale};

/// Tangents of the flattest and steepest slopes that are taken for a flank: below lie tops and
/// valleys, above edges between two surfaces.
const FLANK: (f64, f64) = (0.268, 1.2);
/// With fewer flank cells a pile says nothing of its own angle.
const FEWEST: usize = 30;
/// Slopes are taken over squares of this share of the pile's edge: more of it would round off the
/// ridges, less would measure noise.
const SHARE: f64 = 1.0 / 24.0;

/// Tangent of the angle of repose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Repose {
    pub(crate) slope: f64,
    /// Standard uncertainty of the slope of a flank that nobody saw.
    pub(crate) u_slope: f64,
}

/// What bulk material does: 20° to 45°, each angle as likely as the other (GUM 4.3.7).
const ANY: Repose = Repose { slope: 0.637, u_slope: 0.178 };

impl Repose {
    /// The slope of the pile on `cells`, whose heights are `height`; NaN where nothing was seen.
    ///
    /// The flanks differ by their scatter, and so may the one that is hidden.
    pub(crate) fn of(grid: &Grid, cells: &[usize], height: impl Fn(usize) -> f64) -> Self {
        let reach = (SHARE * (cells.len() as f64).sqrt()).round().max(1.0) as isize;
        let slopes = cells.iter().filter_map(|&cell| slope(grid, cell, reach, &height));
        let flanks: Vec<f64> = slopes.filter(|s| (FLANK.0..FLANK.1).contains(s)).collect();
        if flanks.len() < FEWEST {
            return ANY;
        }
        let slope = median(flanks.clone());
        let off: Vec<f64> = flanks.iter().map(|s| s - slope).collect();
        Self { slope, u_slope: scale(off) }
    }

    /// The slope if it were `times` its uncertainty steeper.
    pub(crate) fn steeper(self, times: f64) -> f64 {
        (self.slope + times * self.u_slope).max(FLANK.0)
    }
}

/// Slope of the least-squares plane through the square around a cell, if all of it was seen.
fn slope(grid: &Grid, cell: usize, reach: isize, height: impl Fn(usize) -> f64) -> Option<f64> {
    let (mut rise, mut runs) = ([0.0; 2], 0.0);
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let h = height(grid.neighbor(cell, dx, dy)?);
            if h.is_nan() {
                return None;
            }
            rise[0] += dx as f64 * h;
            rise[1] += dy as f64 * h;
            runs += (dx * dx) as f64 * grid.cell_m;
        }
    }
    Some(rise[0].hypot(rise[1]) / runs)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [0.0; 2], cell_m: 0.1, columns: 60, rows: 60 };

    fn cone(cell: usize) -> f64 {
        let [x, y] = GRID.center(cell);
        1.2 - 0.45 * (x - 3.0).hypot(y - 3.0)
    }

    #[test]
    fn a_cone_has_its_slope_and_a_table_any() {
        let cells: Vec<usize> = (0..GRID.len()).filter(|&cell| cone(cell) > 0.0).collect();
        let repose = Repose::of(&GRID, &cells, cone);
        assert!((repose.slope - 0.45).abs() < 0.005 && repose.u_slope < 0.01, "{repose:?}");
        assert_eq!(Repose::of(&GRID, &cells, |_| 1.0), ANY);
        assert_eq!(Repose::of(&GRID, &cells, |_| f64::NAN), ANY);
        assert!(repose.steeper(1.0) > repose.slope && repose.steeper(-1e9) > 0.0);
    }
}
