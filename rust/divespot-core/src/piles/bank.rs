//! The heights of banks and walls that continue below a pile which leans on them, in m.

use crate::heightmap::Grid;

/// A bank's plane is fitted to its cells within this many columns and rows of the nearest one.
/// Chosen on the scenes of `divespot evaluate`.
pub(super) const SUPPORT: usize = 4;
/// The toe of an object extends over this many cells of a bank. Chosen on the scenes of `divespot
/// evaluate`.
pub(super) const TOE: usize = 2;
/// Banks are looked at within this many columns and rows around an object: toe plus support.
pub(crate) const REACH: usize = TOE + SUPPORT;

/// Heights of banks and walls below an object, in m; NaN where there is none.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bank {
    pub(super) grid: Grid,
    pub(super) heights_m: Vec<f64>,
    /// Standard uncertainty of the mean height over a cell, in m.
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
