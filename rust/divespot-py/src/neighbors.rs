//! Binds the filters of outliers; radii in m.

use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::interrupt::{attempted, detached};
use crate::points::{Column, Near, cloud_for, need};

#[pyfunction]
pub(crate) fn radius_outlier_mask<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    radius_m: f64,
    min_neighbors: usize,
    threads: usize,
    own: bool,
    by_position: bool,
) -> PyResult<Column<'py, bool>> {
    let near = Near::of(points, own, threads, need::NEIGHBORS)?;
    let points = &*near.points();
    let masked = match by_position {
        true => divespot_core::positions::radius_position_mask,
        false => divespot_core::radius_outlier_mask,
    };
    let mask = attempted(py, || masked(points, radius_m, min_neighbors, threads))?;
    Ok(near.spread(mask, false).into_pyarray(py))
}

#[pyfunction]
pub(crate) fn surface_mask<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    threads: usize,
) -> PyResult<Column<'py, bool>> {
    let (cloud, count) = cloud_for(points, threads, need::STRAYS)?;
    let mask = detached(py, || {
        let threads = divespot_core::thread_count(threads);
        divespot_core::surface_outliers::surface_mask(&cloud.points, threads)
    })?;
    Ok(cloud.spread(mask, false, count).into_pyarray(py))
}
