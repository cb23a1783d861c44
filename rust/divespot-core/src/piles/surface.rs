//! A base surface that was given: a height in m for every cell of a grid.

use crate::heightmap::Grid;

/// A height for every cell of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    pub(super) grid: Grid,
    pub(super) heights_m: Vec<f64>,
    pub(super) known: Vec<bool>,
    /// Standard deviation of a cell's height from the scan's noise alone, in m.
    pub noise_m: f64,
    /// Standard uncertainty of the height of an unseen cell, in m.
    pub(super) u_unknown_m: f64,
}

impl Surface {
    /// The same surface at height 0 and without noise: heights above it contain the noise of both
    /// scans.
    pub(crate) fn flattened(&self) -> Self {
        Self { heights_m: vec![0.0; self.heights_m.len()], noise_m: 0.0, ..self.clone() }
    }

    /// Whether the surface was seen at a place of the grid.
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
