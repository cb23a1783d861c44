//! Sums up any number of points in bounded memory: voxels with integer sums, merged in any order.

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
