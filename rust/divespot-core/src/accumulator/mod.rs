//! Any number of points in bounded memory: voxels that hold integer sums, and merge in any order.

mod accumulate;
mod bytes;
mod lattice;
mod records;
mod sums;
mod surface;
mod tiles;

pub use accumulate::{Accumulator, Held};
pub use records::{Class, Records, Returns, Told, Wanted};
pub(crate) use surface::ONE;

#[cfg(test)]
mod tests;
