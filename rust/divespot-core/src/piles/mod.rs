//! Measures the objects that stand on the ground: footprint (m²), base surface, volume (m³), shape.
//!
//! A volume cut off above the ground misses the toe (paper, "Voxel Meshing Calculation"); the paper
//! corrects this with an empirical factor. Here the cells of the toe are summed with their sign.
//! Outside the pile they average to zero, so no factor is needed.

mod alone;
mod around;
mod axis;
mod bank;
mod banks;
mod base;
mod budget;
mod buried;
mod classify;
mod clear;
mod crease;
mod cut;
mod difference;
mod divided;
mod earlier;
mod enclosed;
mod face;
mod faces;
mod flat_top;
mod floating;
mod found;
mod gaps;
mod hidden;
mod measure;
mod nodes;
mod object;
mod outline;
mod part;
mod part_height;
mod patch;
mod reason;
mod region;
mod repose;
mod retaining;
mod ring;
mod scene;
mod sectors;
mod settings;
mod shadow;
mod standing;
mod surface;
mod territory;
mod things;
mod valley;
mod wall;
mod waves;

pub use crate::pieces::pieces;
pub use base::{Base, Kind};
pub use budget::Budget;
pub use difference::{Seen, measure_difference};
pub use found::{Found, Marked};
pub use measure::{base_map, measure};
pub use object::Object;
pub use part::Ring;
pub use reason::Reason;
pub use region::{Region, measure_inside};
pub use settings::Settings;
pub use surface::Surface;

#[cfg(test)]
mod tests;
