//! Banks and walls that go on below a pile which leans on them.

use crate::heightmap::Grid;

/// A bank goes on as it is in its cells so many columns and rows around the nearest.
pub(super) const SUPPORT: usize = 4;
/// The toe lies on so many cells of it.
pub(super) const TOE: usize = 2;
/// What lies farther from an object tells nothing of the bank beside it, in columns and rows.
pub(crate) const REACH: usize = TOE + SUPPORT;

/// Heights of banks and walls below an object; NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    pub(super) grid: Grid,
    pub(super) heights_m: Vec<f64>,
    /// Standard uncertainty of the mean height over a cell.
    pub(super) u_m: Vec<f64>,
}

impl Bank {
    pub(crate) fn at(&self, p: [f64; 2]) -> f64 {
        if self.grid.holds(&[p[0], p[1], 0.0]) {
            self.heights_m[self.grid.cell(&p)]
        } else {
            f64::NAN
        }
    }

    pub(crate) fn u_m(&self, p: [f64; 2]) -> f64 {
        if self.grid.holds(&[p[0], p[1], 0.0]) { self.u_m[self.grid.cell(&p)] } else { 0.0 }
    }
}
