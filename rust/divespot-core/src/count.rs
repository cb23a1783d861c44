//! Counts as floating-point numbers.

/// A count of points or cells as `f64`; exact, since all are far below 2⁵³.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn to_f64(n: usize) -> f64 {
    n as f64
}
