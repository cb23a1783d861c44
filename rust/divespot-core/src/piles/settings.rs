//! The settings of measuring; lengths in m or in cells, as the names say.

use super::base::Base;

/// The settings of measuring.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Width of the toe around the labelled cells, in steps of one cell.
    pub toe_cells: u32,
    /// Width of the annulus of ground beyond the toe, as a share of the edge of a square as large
    /// as the object.
    pub annulus_share: f64,
    /// Height above the base from which a cell certainly belongs to the object.
    pub margin_m: f64,
    /// The base of every object; `None` for a local base from the ground around each.
    pub base: Option<Base>,
    /// Other bases whose volumes are compared.
    pub compared: Vec<Option<Base>>,
    /// The base where the annulus has too few cells.
    pub ground: Base,
    /// Components of a thing with no wider gap between them, in cells, are one.
    pub link_cells: u32,
    /// Fewest cells of a thing.
    pub fewest_cells: usize,
    /// Number of threads; 0 for every core the process may use.
    pub threads: usize,
}
