//! Binds the histogram of heights and the height of the ground; heights in m.

use divespot_core::GroundRule;
use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::errors::DivespotError;
use crate::interrupt::attempted;
use crate::points::{Column, heights_of};

#[pyfunction]
pub(crate) fn height_histogram<'py>(
    py: Python<'py>,
    heights_m: &Bound<'py, PyAny>,
    bin_m: f64,
    window: usize,
) -> PyResult<(Column<'py, f64>, Column<'py, u32>, Column<'py, f64>)> {
    let heights = heights_of(heights_m)?;
    let histogram = attempted(py, || divespot_core::height_histogram(&heights, bin_m, window))?;
    let centers: Vec<f64> = (0..histogram.counts.len()).map(|i| histogram.center_m(i)).collect();
    Ok((
        centers.into_pyarray(py),
        histogram.counts.into_pyarray(py),
        histogram.smoothed.into_pyarray(py),
    ))
}

#[pyfunction]
pub(crate) fn ground_height(
    py: Python<'_>,
    heights_m: &Bound<'_, PyAny>,
    bin_m: f64,
    window: usize,
    rule: &str,
    lower_fraction: f64,
) -> PyResult<f64> {
    let heights = heights_of(heights_m)?;
    let rule = ground_rule(rule)?;
    attempted(py, || divespot_core::ground_height(&heights, bin_m, window, rule, lower_fraction))
}

fn ground_rule(name: &str) -> PyResult<GroundRule> {
    match name {
        "first" => Ok(GroundRule::First),
        "lower" => Ok(GroundRule::Lower),
        "midpoint" => Ok(GroundRule::Midpoint),
        _ => Err(DivespotError::new_err(format!(
            "rule is '{name}': 'first', 'lower' or 'midpoint' is needed"
        ))),
    }
}
