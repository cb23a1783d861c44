//! The uncertainty budget of a volume, term by term, in m³ (GUM, JCGM 100:2008; Anderson 2019, ESPL
//! 44:1015).

use super::base::Base;
use super::gaps::Filled;
use super::window::{Window, Zone};
use crate::connectivity::FOUR;
use crate::hypotenuse::Hypotenuse;

/// Standard uncertainties of one volume, in m³, independent of each other.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Budget {
    /// Noise of the cells' heights, independent from cell to cell.
    pub noise_m3: f64,
    /// Errors of registration that fused frames have in common over the whole object or one of its
    /// flanks, so that they do not average out.
    pub registration_m3: f64,
    /// Height of the base, common to all cells.
    pub base_m3: f64,
    /// Where the object ends: half the change of volume when the toe is one cell wider; at walls
    /// the scatter of their faces, or a part of a cell where no face was found.
    pub footprint_m3: f64,
    /// Cells that were filled, not seen.
    pub filled_m3: f64,
    /// Curvature of the surface within the cells.
    pub grid_m3: f64,
    /// Scale of the sensor.
    pub scale_m3: f64,
}

/// Registration error of fused frames, in standard deviations of a ground cell. Frames are
/// displaced vertically and sideways, and they have different weights on different flanks. Fitted,
/// by `divespot evaluate --density 0.15 --seeds 2` and `--scenes 'levels-*,body-*' --seeds 3`: with
/// it u95 holds as often as it should with all points and with 15 % of them.
const COMMON: f64 = 0.4;
/// Relative standard uncertainty of a volume from the scale of the sensor: 0.0005 along each of
/// three axes, fully correlated. Assumed: depth cameras and survey instruments are calibrated no
/// better.
const SCALE: f64 = 0.0015;

impl Budget {
    /// Combined standard uncertainty of the volume, in m³.
    #[must_use]
    pub fn combined_m3(&self) -> f64 {
        self.terms().iter().map(|(_, u_m3)| u_m3 * u_m3).sum::<f64>().sqrt()
    }

    /// Every term by its name.
    #[must_use]
    pub fn terms(&self) -> [(&'static str, f64); 7] {
        let Self { noise_m3, registration_m3, base_m3, footprint_m3, filled_m3, grid_m3, scale_m3 } =
            *self;
        [
            ("noise_m3", noise_m3),
            ("registration_m3", registration_m3),
            ("base_m3", base_m3),
            ("footprint_m3", footprint_m3),
            ("filled_m3", filled_m3),
            ("grid_m3", grid_m3),
            ("scale_m3", scale_m3),
        ]
    }

    /// The budget of the object in `window`, whose heights above the base are `gaps.above_m`. The
    /// toe is `steps` cells wide.
    pub(crate) fn of(window: &Window, base: &Base, gaps: &Filled, steps: u32) -> Self {
        let filled = &gaps.above_m;
        let area = window.grid.cell_m * window.grid.cell_m;
        let held: Vec<usize> = window.held().collect();
        let share = |cell: usize| window.counted(cell).share;
        let sum = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |a, b| a + b) * area;
        let cells: f64 = held.iter().map(|&c| share(c)).sum();
        let squares: f64 = held.iter().map(|&c| share(c) * share(c)).sum();
        let unknown = held.iter().map(|&c| share(c) * base.u_unknown_m(window.grid.center(c)));
        // The toe's volume divided by its width in cells is what one more cell of toe would hold.
        let toe = window.cells(Zone::Toe).filter(|&c| !window.walls[c]);
        let toe_m3 = sum(&mut toe.map(|c| filled[c]));
        let walled_m3 = sum(&mut held.iter().map(|&c| window.counted(c).u_share * filled[c]));
        let volume_m3 = sum(&mut held.iter().map(|&c| share(c) * filled[c]));
        let rise_m2 = sum(&mut held.iter().map(|&c| share(c) * slope(window, filled, c)));
        let curvature = held.iter().map(|&c| share(c) * laplacian(window, filled, c));
        Self {
            noise_m3: squares.sqrt() * area * base.noise_m,
            registration_m3: COMMON * base.noise_m * (cells * area).hypotenuse(rise_m2),
            base_m3: (cells * area * base.u_level_m).hypotenuse(sum(&mut unknown.into_iter())),
            footprint_m3: (0.5 * toe_m3.abs() / f64::from(steps.max(1))).hypotenuse(walled_m3),
            filled_m3: gaps.u_m3,
            grid_m3: sum(&mut curvature.map(|l| l / 24.0)).abs(),
            scale_m3: SCALE * volume_m3.abs(),
        }
    }
}

/// Slope around a cell, as rise over run: root of the summed mean squares along x and y.
fn slope(window: &Window, filled: &[f64], cell: usize) -> f64 {
    let around = window.grid.neighbors(cell, &FOUR);
    let squares = around.map(|n| (filled[n] - filled[cell]).powi(2)).filter(|d| !d.is_nan());
    let (count, sum) = squares.fold((0.0, 0.0), |(count, sum), d| (count + 1.0, sum + d));
    (2.0 * sum / f64::max(count, 1.0)).sqrt() / window.grid.cell_m
}

/// Sum of the second differences around a cell, in m. The midpoint rule's error is 1/24 of it.
fn laplacian(window: &Window, filled: &[f64], cell: usize) -> f64 {
    let around = window.grid.neighbors(cell, &FOUR);
    around.map(|n| filled[n] - filled[cell]).filter(|d| !d.is_nan()).sum()
}

#[cfg(test)]
mod tests {
    use super::super::base::Kind;
    use super::super::tests::{CELL, exact, window_of};
    use super::*;

    /// The budget of a square of 2 m on a level base, which these heights are above, and its cells.
    fn budget(
        height: impl Fn(f64, f64) -> f64,
        noise_m: f64,
        u_level_m: f64,
        u_filled_m3: f64,
    ) -> (Budget, f64) {
        let window =
            window_of(&exact(height), |x, y| (x - 4.0).abs() < 1.0 && (y - 3.0).abs() < 1.0);
        let base = Base::plane(0.0, [0.0; 2], noise_m, u_level_m, Kind::Given);
        let gaps = Filled { above_m: window.heights_m.clone(), u_m3: u_filled_m3 };
        (Budget::of(&window, &base, &gaps, 4), window.held().count() as f64)
    }

    fn is_near(value: f64, truth: f64) -> bool {
        (value / truth - 1.0).abs() < 1e-9
    }

    #[test]
    fn noise_averages_out_and_what_cells_have_in_common_does_not() {
        let (level, cells) = budget(|_, _| 1.0, 0.02, 0.0, 0.0);
        let area = cells * CELL * CELL;
        assert!(is_near(level.noise_m3, 0.02 * area / cells.sqrt()), "{level:?}");
        // Off by four tenths of the scatter, upwards; on a flank of 45° sideways too.
        assert!(is_near(level.registration_m3, 0.4 * 0.02 * area), "{level:?}");
        let (slope, _) = budget(|x, _| x, 0.02, 0.0, 0.0);
        assert!(is_near(slope.registration_m3 / level.registration_m3, 2.0_f64.sqrt()));
    }

    #[test]
    fn a_base_that_is_off_is_off_below_all_cells() {
        let (budget, cells) = budget(|_, _| 1.0, 0.0, 0.003, 0.0);
        assert!(is_near(budget.base_m3, 0.003 * cells * CELL * CELL), "{budget:?}");
        assert_eq!((budget.noise_m3, budget.registration_m3, budget.filled_m3), (0.0, 0.0, 0.0));
    }

    #[test]
    fn the_scale_is_that_of_three_coordinates_half_a_part_in_a_thousand_off() {
        let (budget, cells) = budget(|_, _| 2.0, 0.0, 0.0, 0.0);
        let volume = |scale: f64| cells * (CELL * scale).powi(2) * 2.0 * scale;
        let off = volume(1.0005) - volume(1.0);
        assert!((budget.scale_m3 / off - 1.0).abs() < 1e-3, "{budget:?} {off}");
    }

    #[test]
    fn a_cell_misses_what_a_bowl_curves_within_it() {
        let bowl = |x: f64, y: f64| 0.3 * ((x - 4.0).powi(2) + (y - 3.0).powi(2));
        let (budget, cells) = budget(bowl, 0.0, 0.0, 0.0);
        // The mean of x² over a cell is a twelfth of its edge squared above that in its middle.
        assert!((budget.grid_m3 / (cells * 0.3 * CELL.powi(4) / 6.0) - 1.0).abs() < 0.02);
    }

    #[test]
    fn the_toe_may_end_half_a_cell_farther_out() {
        let (budget, cells) = budget(|_, _| 1.0, 0.0, 0.0, 0.0);
        let toe_m3 = (cells - 1024.0) * CELL * CELL;
        assert!(is_near(budget.footprint_m3, 0.5 * toe_m3 / 4.0), "{budget:?}");
    }

    #[test]
    fn terms_add_up_as_squares() {
        let budget = Budget { noise_m3: 3.0, base_m3: 4.0, filled_m3: 12.0, ..Budget::default() };
        assert!(is_near(budget.combined_m3(), 13.0));
    }
}
