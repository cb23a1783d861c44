//! Middles and spreads that a few strays do not move.

/// Standard deviation of normal values, from the median of their sizes.
pub(crate) fn scale(off: &[f64]) -> f64 {
    1.4826 * median(off.iter().map(|r| r.abs()).collect())
}

pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
