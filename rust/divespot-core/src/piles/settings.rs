//! How objects are measured.

use super::base::Base;

/// How objects are measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Steps of one cell around the labelled cells that may hold the toe.
    pub toe_cells: u32,
    /// Width of the ring of ground beyond the toe, as a share of the edge of a square as large as
    /// the object.
    pub ring_share: f64,
    /// Cells this high above their base are the object's beyond doubt.
    pub margin_m: f64,
    /// The base of every object; `None` for the one that the ground around each lets expect.
    pub base: Option<Base>,
    /// Further bases whose volumes are wanted for comparison.
    pub compared: Vec<Option<Base>>,
    /// The base where a ring says nothing.
    pub ground: Base,
    /// Pieces of a thing with no wider gap between them, in cells, are one.
    pub link_cells: u32,
    /// A thing of fewer cells is none.
    pub fewest_cells: usize,
    /// 0 takes every core that the process may use.
    pub threads: usize,
}
