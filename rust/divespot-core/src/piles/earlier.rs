//! A base surface from an earlier scan of the empty floor, or from a saved base; heights in m.
//!
//! Gaps of one cell are closed by the mean of their neighbours, larger ones by harmonic
//! interpolation.

use super::base::{Base, FEWEST};
use super::surface::Surface;
use crate::connectivity::FOUR;
use crate::heightmap::Grid;
use crate::robust::{median, scale};
use crate::{Error, Point, Result};

/// Noise of a cell's height less the mean of its four neighbours, relative to a cell's own: √(1 +
/// 1/4).
const OF_FOUR: f64 = 1.118;

impl Surface {
    /// The surface through `heights_m`, one for each cell of `grid`, NaN where unseen.
    ///
    /// An unseen cell with two or more seen neighbours gets their mean and counts as known, because
    /// the cells of two scans rarely coincide. All others are interpolated harmonically; their
    /// standard uncertainty is the floor's scatter about its plane.
    ///
    /// # Errors
    ///
    /// Too few heights for a surface.
    pub fn over(grid: Grid, mut heights_m: Vec<f64>) -> Result<Self> {
        let noise_m = noise(&grid, &heights_m, 1);
        close_small_gaps(&grid, &mut heights_m);
        let place = |cell: usize| {
            let [x, y] = grid.center(cell);
            (!heights_m[cell].is_nan()).then_some([x, y, heights_m[cell]])
        };
        let seen: Vec<Point> = (0..grid.len()).filter_map(place).collect();
        let plane = Base::around(middle(&seen), &seen, grid.cell_m).ok_or(Error::TooFewPoints {
            what: "a surface that shares its place with the scan",
            given: seen.len(),
            needed: FEWEST,
        })?;
        let u_unknown_m = plane.noise_m;
        let harmonic = plane.with_harmonic(&grid, &seen);
        let known: Vec<bool> = heights_m.iter().map(|h| !h.is_nan()).collect();
        for (cell, height) in heights_m.iter_mut().enumerate().filter(|(_, h)| h.is_nan()) {
            *height = harmonic.at(grid.center(cell));
        }
        Ok(Self { grid, heights_m, known, noise_m, u_unknown_m })
    }
}

fn middle(seen: &[Point]) -> [f64; 2] {
    [0, 1].map(|k| median(seen.iter().map(|p| p[k]).collect()))
}

/// The seen heights of the four cells `away` columns or rows from one.
fn neighbors(grid: &Grid, heights_m: &[f64], cell: usize, away: isize) -> Vec<f64> {
    let next = FOUR.iter().filter_map(|&(dx, dy)| grid.neighbor(cell, away * dx, away * dy));
    next.map(|n| heights_m[n]).filter(|h| !h.is_nan()).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Noise of a cell's height in m, from its difference to the mean of its four neighbours `away`
/// columns or rows off: slopes and long undulations cancel.
pub(crate) fn noise(grid: &Grid, heights_m: &[f64], away: isize) -> f64 {
    let off = (0..grid.len()).filter_map(|cell| {
        let around = neighbors(grid, heights_m, cell, away);
        let off = heights_m[cell] - mean(&around);
        (around.len() == FOUR.len() && !off.is_nan()).then_some(off)
    });
    scale(off) / OF_FOUR
}

/// Gives unseen cells the mean of their neighbours, if two or more of these were seen.
fn close_small_gaps(grid: &Grid, heights_m: &mut [f64]) {
    let closed: Vec<(usize, f64)> = (0..grid.len())
        .filter(|&cell| heights_m[cell].is_nan())
        .map(|cell| (cell, neighbors(grid, heights_m, cell, 1)))
        .filter(|(_, around)| around.len() > 1)
        .map(|(cell, around)| (cell, mean(&around)))
        .collect();
    closed.into_iter().for_each(|(cell, height)| heights_m[cell] = height);
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { origin_m: [-4.0, 3.0], cell_m: 0.125, columns: 64, rows: 48 };

    fn heights(height: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        (0..GRID.len()).map(|cell| GRID.center(cell)).map(|[x, y]| height(x, y)).collect()
    }

    fn wave(x: f64, y: f64) -> f64 {
        0.7 + 0.02 * x + 0.01 * (x + 0.5 * y).sin()
    }

    #[test]
    fn cells_keep_their_height_and_a_single_gap_is_closed() {
        let mut floor = heights(wave);
        floor[20 * 64 + 20] = f64::NAN;
        let surface = Surface::over(GRID, floor).unwrap();
        for cell in 0..GRID.len() {
            let [x, y] = GRID.center(cell);
            assert!(surface.is_known([x, y]));
            assert!((surface.at([x, y]) - wave(x, y)).abs() < 1e-4);
        }
        assert!(surface.noise_m < 1e-3);
    }

    #[test]
    fn a_hole_is_crossed_and_paid_for() {
        let hole = |x: f64, y: f64| (x - 1.0).hypot(y - 6.0) < 0.8;
        let floor = heights(|x, y| if hole(x, y) { f64::NAN } else { wave(x, y) });
        let surface = Surface::over(GRID, floor).unwrap();
        assert!((surface.at([1.0, 6.0]) - wave(1.0, 6.0)).abs() < 0.004);
        let u = surface.u_unknown_m([1.0, 6.0]);
        assert!(u > 0.002 && u < 0.02 && surface.u_unknown_m([-2.0, 4.0]) == 0.0, "{u}");
    }

    #[test]
    fn noise_is_told_from_waves_and_nothing_seen_is_no_surface() {
        let uniform = |i: u64| (crate::sample::mix(i) >> 11) as f64 / (1_u64 << 53) as f64;
        let mut rough = heights(wave);
        (0..).zip(&mut rough).for_each(|(i, h)| *h += 0.006 * (uniform(i) - 0.5));
        let surface = Surface::over(GRID, rough).unwrap();
        assert!((surface.noise_m / 0.0017 - 1.0).abs() < 0.25, "{}", surface.noise_m);
        let found = Surface::over(GRID, vec![f64::NAN; GRID.len()]);
        assert!(matches!(found, Err(Error::TooFewPoints { given: 0, .. })));
    }
}
