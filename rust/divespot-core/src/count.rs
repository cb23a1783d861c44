//! Counts, to reckon with.

/// A count of points or cells, all far below 2⁵³.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn to_f64(n: usize) -> f64 {
    n as f64
}
