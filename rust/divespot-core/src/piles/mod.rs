//! Measures the objects that stand on the ground: footprint (m²), base surface, volume (m³), shape.
//!
//! A volume cut off above the ground misses the toe (paper, "Voxel Meshing Calculation"); the paper
//! corrects this with an empirical factor. Here the cells of the toe are summed with their sign.
//! Outside the pile they average to zero, so no factor is needed.

mod alone;
mod annulus;
mod around;
mod axis;
mod bank;
mod banks;
mod base;
mod breakline;
mod budget;
mod buried;
mod classify;
mod coverage;
mod cut;
mod detection_limit;
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
mod kriging;
mod measure;
mod nearest_label;
mod nodes;
mod object;
mod occluded_flank;
mod occlusion_edge;
mod outline;
mod part_height;
mod reason;
mod region;
mod repose;
mod retaining;
mod scene;
mod sectors;
mod settings;
mod standing;
mod surface;
mod things;
mod wall;
mod watershed;
mod window;

pub use crate::components::label_components;
pub use base::{Base, Kind};
pub use budget::Budget;
pub use coverage::Ring;
pub use difference::{Seen, measure_difference};
pub use found::{Found, Marked};
pub use measure::{Cells, Standing, base_map, measure};
pub use object::Object;
pub use reason::Reason;
pub use region::{Inside, Region, measure_inside};
pub use settings::Settings;
pub use surface::Surface;

#[cfg(test)]
mod tests;
