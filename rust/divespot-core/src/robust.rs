//! Statistics that outliers do not move: median, and standard deviation from the median absolute
//! value.

use crate::cancel::poll;

/// Standard deviation of a normal distribution, in median absolute deviations: closed form.
const NORMAL: f64 = 1.4826;

/// The median of the values, the upper one of two; 0 without values.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    median_in(&mut values)
}

/// The median of values whose order may change.
pub(crate) fn median_in(values: &mut [f64]) -> f64 {
    poll();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Standard deviation of values that are normal about 0, except for a few outliers.
pub(crate) fn scale(off: impl IntoIterator<Item = f64>) -> f64 {
    NORMAL * median(off.into_iter().map(f64::abs).collect())
}
