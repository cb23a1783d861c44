//! A surface that was given as what objects stand on.

use crate::heightmap::Grid;

/// A height for every cell of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    pub(super) grid: Grid,
    pub(super) heights_m: Vec<f64>,
    pub(super) known: Vec<bool>,
    /// Standard deviation of a cell's height from the noise of the scan alone.
    pub noise_m: f64,
    /// Standard uncertainty of the height of a cell that was not seen.
    pub(super) u_unknown_m: f64,
}

impl Surface {
    /// The same as nought, without noise: that of the heights above it has both.
    pub(crate) fn flattened(&self) -> Self {
        Self { heights_m: vec![0.0; self.heights_m.len()], noise_m: 0.0, ..self.clone() }
    }

    /// Whether the surface rests on what was seen at a place of the grid.
    pub(crate) fn is_known(&self, p: [f64; 2]) -> bool {
        self.known[self.grid.cell(&p)]
    }

    pub(crate) fn at(&self, p: [f64; 2]) -> f64 {
        self.heights_m[self.grid.cell(&p)]
    }

    pub(crate) fn u_unknown_m(&self, p: [f64; 2]) -> f64 {
        if self.is_known(p) { 0.0 } else { self.u_unknown_m }
    }
}
