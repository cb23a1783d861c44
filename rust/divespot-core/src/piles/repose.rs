//! The angle of repose of a pile, from the slopes of its own flanks, as rise over run.
//!
//! Method: median slope of least-squares planes over small squares of the surface.

use std::ops::Range;

use crate::cancel::Polled;
use crate::heightmap::Grid;
use crate::hypotenuse::Hypotenuse;
use crate::material::{FLATTEST, STEEPEST_POURED};
use crate::robust::{median, scale};

/// Slopes of a flank, 15° to 50°: flatter ones are tops and valleys, steeper ones edges between two
/// surfaces.
const FLANK: Range<f64> = FLATTEST..STEEPEST_POURED;
/// The fewest flank cells for a pile's own angle; with fewer, that of any material is used. Chosen:
/// their median is then known to a quarter of their scatter (closed form: 1.25 / √30).
const FEWEST: usize = 30;
/// Width of the squares over which slopes are fitted, as a share of the pile's width. Larger ones
/// round off the ridges, smaller ones measure noise. Chosen on the scenes of `divespot evaluate`.
const SHARE: f64 = 1.0 / 24.0;

/// The angle of repose, as rise over run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Repose {
    pub(crate) slope: f64,
    /// Standard uncertainty of the slope of one occluded flank.
    pub(crate) u_slope: f64,
}

impl Repose {
    /// Any bulk material: 20° to 45°, all equally likely (rectangular distribution, GUM 4.3.7): the
    /// tangent of 32.5°, and 25°/√12 as a slope.
    pub(crate) const ANY: Self = Self { slope: 0.637, u_slope: 0.178 };

    /// The slope of the pile on `cells`, from their heights; NaN where unseen.
    ///
    /// The uncertainty is the scatter of the seen flanks, since the occluded one may differ as
    /// much.
    pub(crate) fn of(grid: &Grid, cells: &[usize], height: impl Fn(usize) -> f64) -> Self {
        let reach = (SHARE * (cells.len() as f64).sqrt()).round().max(1.0) as usize;
        let band = Band::around(grid, cells, reach, height);
        let slopes = cells.iter().polled().map(|&cell| band.slope(cell, reach));
        let flanks: Vec<f64> = slopes.filter(|s| FLANK.contains(s)).collect();
        if flanks.len() < FEWEST {
            return Self::ANY;
        }
        let slope = median(flanks.clone());
        let off: Vec<f64> = flanks.iter().map(|s| s - slope).collect();
        Self { slope, u_slope: scale(off) }
    }

    /// The slope, steeper by `times` its uncertainty.
    pub(crate) fn steeper(self, times: f64) -> f64 {
        (self.slope + times * self.u_slope).max(FLATTEST)
    }
}

/// The heights of the rows that hold the cells, each evaluated once.
struct Band<'a> {
    grid: &'a Grid,
    first: usize,
    heights_m: Vec<f64>,
}

impl<'a> Band<'a> {
    /// The rows that hold the squares around all `cells`.
    fn around(
        grid: &'a Grid,
        cells: &[usize],
        reach: usize,
        height: impl Fn(usize) -> f64,
    ) -> Self {
        let margin = reach * (grid.columns + 1);
        let first = cells.iter().min().map_or(0, |cell| cell.saturating_sub(margin));
        let end = cells.iter().max().map_or(0, |cell| (cell + margin + 1).min(grid.len()));
        Self { grid, first, heights_m: (first..end).polled().map(height).collect() }
    }

    /// Slope of the least-squares plane through the square around a cell; NaN unless all of it was
    /// seen.
    fn slope(&self, cell: usize, reach: usize) -> f64 {
        let width = self.grid.columns;
        let inside = |at: usize, end: usize| at >= reach && at + reach < end;
        if !inside(cell % width, width) || !inside(cell / width, self.grid.rows) {
            return f64::NAN;
        }
        let off = |i: usize| i as f64 - reach as f64;
        let side = 2 * reach + 1;
        let (mut along, mut across) = (0.0, 0.0);
        for row in 0..side {
            let start = cell + row * width - reach * (width + 1) - self.first;
            let heights = &self.heights_m[start..start + side];
            // Row by row, so that the sums of one row do not wait for those of the row before
            // (speed).
            let sums = heights.iter().enumerate();
            let (turn, sum) = sums.fold((0.0, 0.0), |(t, s), (i, h)| (t + off(i) * h, s + h));
            along += turn;
            across += off(row) * sum;
        }
        let squares: f64 = (0..side).map(|i| off(i) * off(i)).sum();
        along.hypotenuse(across) / (side as f64 * squares * self.grid.cell_m)
    }
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
        assert_eq!(Repose::of(&GRID, &cells, |_| 1.0), Repose::ANY);
        assert_eq!(Repose::of(&GRID, &cells, |_| f64::NAN), Repose::ANY);
        assert!(repose.steeper(1.0) > repose.slope && repose.steeper(-1e9) > 0.0);
    }

    #[test]
    fn thirty_cells_of_a_flank_tell_its_angle() {
        let flank = |cell: &usize| (0.2..0.8).contains(&cone(*cell));
        let cells: Vec<usize> = (0..GRID.len()).filter(flank).collect();
        let told = |count: usize| Repose::of(&GRID, &cells[..count], cone) != Repose::ANY;
        assert!(told(45) && !told(20));
    }

    #[test]
    fn slopes_are_taken_over_a_twenty_fourth_of_the_edge() {
        // Of a pile of 60 by 60 cells, over squares of seven.
        let cells: Vec<usize> = (0..GRID.len()).collect();
        let strip = |rows: usize| {
            let seen = move |cell: usize| (30..30 + rows).contains(&(cell / 60));
            let height = move |cell| if seen(cell) { 0.5 * GRID.center(cell)[1] } else { f64::NAN };
            Repose::of(&GRID, &cells, height)
        };
        assert!((strip(7).slope - 0.5).abs() < 1e-9 && strip(5) == Repose::ANY);
    }

    #[test]
    fn any_angle_is_as_likely_from_20_to_45_degrees() {
        let [low, high] = [20.0_f64, 45.0].map(|degrees| degrees.to_radians());
        let middle = (0.5 * (low + high)).tan();
        let u_slope = (high - low) / 12.0_f64.sqrt() * (1.0 + middle * middle);
        let Repose { slope, u_slope: u } = Repose::ANY;
        assert!((slope / middle - 1.0).abs() < 0.01 && (u / u_slope - 1.0).abs() < 0.01);
    }

    #[test]
    fn nothing_poured_lies_flatter_than_15_degrees_or_steeper_than_50() {
        let cells: Vec<usize> = (0..GRID.len()).collect();
        let is_flank = |slope: f64| {
            Repose::of(&GRID, &cells, |cell| slope * GRID.center(cell)[1]) != Repose::ANY
        };
        assert!(is_flank(0.3) && !is_flank(0.2) && is_flank(1.1) && !is_flank(1.4));
    }
}
