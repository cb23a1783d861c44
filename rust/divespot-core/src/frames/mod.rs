//! Registers and fuses depth frames: from the pixels of a sequence to one scan.
//!
//! Small plane patches are fitted to a frame and registered with a model of all frames before
//! (ICP); then all poses are solved for jointly, with the floor as a smooth surface. Every sum is
//! taken in a fixed order or in integers. Lengths in m.

mod camera;
mod confidence;
mod cutter;
mod edges;
mod fusion;
mod icp;
mod joint;
mod keyframe;
mod keys;
mod learning;
mod links;
mod model;
mod motion;
mod noise;
mod normal_equations;
mod observations;
mod patches;
mod search;
mod state;
mod still;
mod track;
mod voxels;

pub use camera::Camera;
pub use cutter::Cutter;
pub use edges::usable_pixels;
pub use fusion::{Fused, Fusion};
pub use joint::Joint;
pub use motion::Motion;
pub use noise::{Noise, NoiseTable};
pub use patches::{Patch, patches};
pub use still::{Averaged, Still};
pub use track::{Lost, Placed, Tracker};
