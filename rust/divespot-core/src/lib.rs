//! divespot's science in pure Rust: from a point cloud of bulk material to volumes.
//!
//! Every kernel takes finite coordinates near a local origin (see [`Cloud`]) in metres, and
//! returns the same bits for the same points in any order, at any number of threads.

mod error;
mod fixed;
mod parallel;

pub mod cloud;
pub mod hdbscan;
pub mod sample;

pub use cloud::{Bounds, Cloud};
pub use error::{Error, Result};
pub use parallel::thread_count;

/// One point, `[x, y, z]` in metres, relative to the cloud's origin.
pub type Point = [f64; 3];
