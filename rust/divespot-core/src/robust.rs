//! Statistics that stray values do not move.

use crate::cancel::poll;

/// Standard deviation of normal values in median absolute ones.
const NORMAL: f64 = 1.4826;

/// The middle one of the values, the upper of two; 0 where there is none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    median_in(&mut values)
}

/// The median of values that may be put in another order.
pub(crate) fn median_in(values: &mut [f64]) -> f64 {
    poll();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Standard deviation of values about 0 that are normal, a few strays apart.
pub(crate) fn scale(off: impl IntoIterator<Item = f64>) -> f64 {
    NORMAL * median(off.into_iter().map(f64::abs).collect())
}
