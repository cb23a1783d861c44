//! The whole height map with its faces and banks, as the input of measuring.

use super::faces::Faces;
use super::found::Found;
use crate::error::Result;
use crate::extent::without_lone;
use crate::heightmap::Grid;

/// The whole height map; heights in m.
pub(crate) struct Scene<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) heights_m: Vec<f64>,
    /// Cells outside the convex hull of the seen surface and walls.
    pub(crate) off_scan: Vec<bool>,
    /// The faces that rise from the surface.
    pub(crate) faces: Faces,
    /// Cells of banks that lead to higher ground.
    pub(crate) banks: Vec<bool>,
}

impl<'a> Scene<'a> {
    /// The scene of a height map. Nearly isolated cells count as unseen, and so do cells at a face,
    /// whose mean height is that of neither surface.
    pub(crate) fn new(
        grid: &'a Grid,
        heights_m: &[f64],
        found: &Found,
        margin_m: f64,
    ) -> Result<Self> {
        grid.require_each("heights", heights_m.len())?;
        let mut heights_m = without_lone(grid, heights_m);
        let faces = Faces::of(grid, &heights_m, found, margin_m);
        let off_scan = faces.off_scan(grid, &heights_m);
        (0..grid.len()).filter(|&c| faces.walls.is[c]).for_each(|c| heights_m[c] = f64::NAN);
        let is_bank = |cell: usize| found.is_bank(cell) && !heights_m[cell].is_nan();
        let banks = (0..grid.len()).map(is_bank).collect();
        Ok(Self { grid, heights_m, off_scan, faces, banks })
    }
}
