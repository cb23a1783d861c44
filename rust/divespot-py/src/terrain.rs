use divespot_core::heightmap::Grid;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::errors::raise;

/// The ground in each cell, and its noise.
#[pyfunction]
pub(crate) fn terrain<'py>(
    py: Python<'py>,
    heights_m: PyReadonlyArray2<'py, f64>,
    cell_m: f64,
    level_m: f64,
    near_m: f64,
) -> PyResult<(Bound<'py, PyArray1<f64>>, f64)> {
    let (rows, columns) = heights_m.as_array().dim();
    let grid = Grid { origin_m: [0.0; 2], cell_m, columns, rows };
    let heights: Vec<f64> = heights_m.as_array().iter().copied().collect();
    let found = py
        .detach(|| divespot_core::terrain::terrain(&grid, &heights, level_m, near_m))
        .map_err(raise)?;
    Ok((found.surface_m.into_pyarray(py), found.noise_m))
}
